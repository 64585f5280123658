// SPDX-License-Identifier: GPL-3.0-or-later
// A surgery file as tables and fields that other programs read.
#pragma once

#include <filesystem>
#include <string>

#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

// A heading and one row per record, in the order of the file:
//   record,kind,sequence,source,recorded_s,bytes,observation_sequence,status,quality,flags,
//   register_ms,invert_ms,rebuild_ms,encode_ms,journal_ms,active,max_motion_mm
// recorded_s counts from the first record. Observations and decisions have a source; updates have
// what follows `bytes`; decisions have their outcome as status, and active; flags are joined by
// '+'. Fields that a record does not have are empty. An error at the first record that is not what
// was written.
Result<std::string> records_csv(const io::SurgeryFile& file, const std::filesystem::path& path);

struct FieldSeries {
  std::filesystem::path model;   // .h5 that the surgery was recorded with
  std::filesystem::path folder;  // for write_field_series; is made if it does not exist
};

// For every usable update a file `<stem>-<sequence>.vtu` with the point arrays displacement and,
// where the update has it, sd_mm (both mm, RAS, undeformed to deformed), and `<stem>.pvd`, which
// lists them by their time in s. Gives the number of fields. kInvalidArgument for another model;
// kEmptySet without a usable update; kWriteFailed.
Result<int> write_field_series(const io::SurgeryFile& file, const std::filesystem::path& path,
                               const FieldSeries& series);
// The same with the model at hand (recorded_model of journal_fields.hpp).
Result<int> write_field_series(const io::SurgeryFile& file, const std::filesystem::path& path,
                               const BrainModel& model, const std::filesystem::path& folder);

// The same fields as one file, which appears whole or not at all (io::FieldSeriesFile).
Result<int> write_field_file(const io::SurgeryFile& file, const std::filesystem::path& path,
                             const std::filesystem::path& model, const std::filesystem::path& out);

}  // namespace brainshift::client
