// SPDX-License-Identifier: GPL-3.0-or-later
// A surgery file as tables and fields that other programs read, in the order of the file.
//
// `path` is the surgery's, for messages.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

// The flags' names, joined by '+'; empty without flags.
std::string flags_text(const QualityVerdict& verdict);

// The model that the surgery was recorded with. kInvalidArgument names both ids of another model;
// errors of io::read_model.
Result<BrainModel> recorded_model(const io::SurgeryFile& file, const std::filesystem::path& path,
                                  const std::filesystem::path& model_file);

// Shows every update, usable or not, with its time in s since the first record. An error at the
// first record that is not what was written or cannot be decoded, and of `show`.
using ShowUpdate = std::function<Status(const UpdateMessage&, double time_s)>;
Status visit_updates(const io::SurgeryFile& file, const std::filesystem::path& path,
                     const ShowUpdate& show);

// A heading and one row per record, in the order of the file:
//   record,kind,sequence,source,recorded_s,bytes,observation_sequence,status,quality,flags,
//   register_ms,invert_ms,rebuild_ms,encode_ms,journal_ms,active,max_motion_mm
// recorded_s counts from the first record. Observations and decisions have a source; updates have
// what follows `bytes`; decisions have their outcome as status, and active; flags are joined by
// '+'. Fields that a record does not have are empty. An error at the first record that is not what
// was written.
Result<std::string> records_csv(const io::SurgeryFile& file, const std::filesystem::path& path);

// For every usable update a file `<stem>-<sequence>.vtu` with the point arrays displacement and,
// where the update has them, sd_mm (both mm, RAS, undeformed to deformed) and known (no unit), and
// `<stem>.pvd`, which lists them by their time in s. model: recorded_model(). The folder is made if
// it does not exist. Gives the number of fields. kEmptySet without a usable update; kWriteFailed.
Result<int> write_field_series(const io::SurgeryFile& file, const std::filesystem::path& path,
                               const BrainModel& model, const std::filesystem::path& folder);

// The same fields as one file, which appears whole or not at all (io::FieldSeriesFile).
Result<int> write_field_file(const io::SurgeryFile& file, const std::filesystem::path& path,
                             const BrainModel& model, const std::filesystem::path& out);

}  // namespace brainshift::client
