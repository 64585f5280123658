// SPDX-License-Identifier: GPL-3.0-or-later
// Case files (YAML) to plain values and back, by the table of configuration/case_keys.hpp, and the
// files that a case names. Unknown keys are errors. Every message is one line: file, line, key,
// value, constraint.
#pragma once

#include <filesystem>
#include <string>

#include "common/configuration/case_config.hpp"
#include "common/configuration/case_inputs.hpp"
#include "common/core/error.hpp"

namespace brainshift::io {

// Reads and validates a case file (config/cases/colin27.yaml documents every key). Relative paths
// are taken from the case file's folder. The direction of gravity and the craniotomy's axis are
// normalised. A section of kNeedLabels without anatomy.labels would do nothing and is refused.
// Whether the files that it names exist is for load_case_inputs to say.
Result<CaseConfig> read_case_config(const std::filesystem::path& path);

// The same from text. `file` is what messages name and relative paths start from; it need not
// exist. Sections that do nothing are taken: models of earlier versions have them in their text.
Result<CaseConfig> parse_case_config(const std::string& text, const std::filesystem::path& file);

// A text in double quotes, as YAML reads it back where it is UTF-8.
std::string yaml_text(const std::string& value);

// The case as the text of a case file with every key that does something, absolute paths and
// numbers with all their digits. parse_case_config(case_config_text(c), c.file) gives c again, bit
// for bit, when c is valid and its two directions have length 1 up to rounding; what does nothing
// has its default.
std::string case_config_text(const CaseConfig& config);

// Reads the files that a case names. The MRI, which only pictures need, is just looked up.
// kNotFound, kUnreadable: the message names key and file.
Result<CaseInputs> load_case_inputs(const CaseConfig& config);

// Those of the files that can be read, and the first error of those that cannot.
struct ReadableInputs {
  CaseInputs inputs;
  Status status;
};
ReadableInputs load_readable_inputs(const CaseConfig& config);

}  // namespace brainshift::io
