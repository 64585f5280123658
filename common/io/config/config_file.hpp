// SPDX-License-Identifier: GPL-3.0-or-later
// YAML configuration files to plain values. Unknown keys are errors; every message is one line that
// begins with the file's path, then the key, then the value and the constraint.
#pragma once

#include <filesystem>
#include <string>

#include "common/values/case_config.hpp"
#include "common/values/case_inputs.hpp"
#include "common/core/error.hpp"

namespace brainshift::io {

// Reads and validates a case file (config/cases/colin27.yaml documents every key). Relative paths are
// taken from the case file's folder. gravity direction and craniotomy axis are normalised.
// Does not look whether the files that it names exist: load_case_inputs does.
Result<CaseConfig> read_case_config(const std::filesystem::path& path);

// The same from text; `file` is what messages name and relative paths start from, and need not exist.
Result<CaseConfig> parse_case_config(const std::string& text, const std::filesystem::path& file);

// The case as the text of a case file with every key, absolute paths and numbers with all their digits:
// parse_case_config(case_config_text(c), c.file) gives c again, bit for bit, when c is valid and its two
// directions have length 1 up to rounding.
std::string case_config_text(const CaseConfig& config);

// Reads the files that a case names (the MRI, which only pictures need, is just looked up). kNotFound /
// kUnreadable name key and file.
Result<CaseInputs> load_case_inputs(const CaseConfig& config);

// What a daemon file says (config/daemon.yaml documents every key).
struct DaemonConfig {
  std::string endpoint = "tcp://127.0.0.1:5555";  // tcp://HOST:PORT or ipc://PATH
  std::filesystem::path
      model;  // model file; empty: clients get model_not_ready until one is loaded
  std::filesystem::path journal_dir;  // empty: no journal
  std::string log_level = "info";     // trace, debug, info, warn, error
  int max_clients = 32;               // 1 to 1024
  int max_message_mib = 64;           // 1 to 1024
};
Result<DaemonConfig> read_daemon_config(const std::filesystem::path& path);

}  // namespace brainshift::io
