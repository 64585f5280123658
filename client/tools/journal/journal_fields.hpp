// SPDX-License-Identifier: GPL-3.0-or-later
// The fields of a surgery file, in the order of the file, for what makes files of them.
//
// `path` is the surgery's, for messages.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "common/core/error.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

// Seconds since the first record that it was asked for.
class RecordClock {
 public:
  double seconds(std::int64_t recorded_ns);

 private:
  std::optional<std::int64_t> first_ns_;
};

// kUnreadable: "PATH: KIND SEQUENCE: reason".
tl::unexpected<Error> undecodable_record(const std::filesystem::path& path,
                                         const io::SurgeryRecord& record, const Error& error);

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

// Shows every usable update; gives their number. As above; kUnreadable for a field of another
// number of nodes, kEmptySet without a usable update.
using ShowField = std::function<Status(const Update&, double time_s)>;
Result<int> visit_fields(const io::SurgeryFile& file, const std::filesystem::path& path,
                         const BrainModel& model, const ShowField& show);

}  // namespace brainshift::client
