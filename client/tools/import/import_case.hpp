// SPDX-License-Identifier: GPL-3.0-or-later
// The case that imported data belong to, from its case file or its prepared model.
#pragma once

#include <filesystem>
#include <string>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/io/recording/surgery_record.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

struct ImportCase {
  BrainModel model;
  std::filesystem::path case_file;  // absolute

  Vec3 tumour_centroid() const;
  // Of a surgery file of this case, made now by `software`.
  io::SurgeryMeta meta(const std::string& scenario, const std::string& software) const;
};

// kInvalidArgument unless exactly one of them is given, in the words of the options --case and
// --model.
Status check_one_case(const std::filesystem::path& case_file, const std::filesystem::path& model);

// One of the two is not empty. The model of a case file is built again. Errors of
// patient::read_patient and io::read_model.
Result<ImportCase> load_import_case(const std::filesystem::path& case_file,
                                    const std::filesystem::path& model,
                                    const Progress& progress = {});

}  // namespace brainshift::client
