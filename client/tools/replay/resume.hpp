// SPDX-License-Identifier: GPL-3.0-or-later
// Where a surgery that was interrupted goes on: after the last observation that its journal holds.
//
// A session that starts after a crash knows no observation. What an estimate depends on is the
// newest observation of every source (common/pipeline/evidence.hpp), so the last recorded one of
// each source is sent again, and then all that came after it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/replay/play.hpp"
#include "common/core/error.hpp"
#include "common/io/recording/surgery_record.hpp"

namespace brainshift::client {

struct ResumePoint {
  io::SurgeryMeta meta;
  std::uint64_t records = 0;                  // in the valid prefix
  std::map<std::string, std::uint64_t> last;  // by source: sequence of the last observation
  std::uint64_t last_update = 0;              // its sequence; 0: none
  std::optional<Error> broken;                // what ended the valid prefix
};

// From the valid prefix of a journal, closed or not. kNotFound or kUnreadable when nothing of it
// can be read.
Result<ResumePoint> read_resume_point(const std::filesystem::path& journal);

// What is left to send of a recording, in its order.
std::vector<RecordedObservation> remaining(const std::vector<RecordedObservation>& recording,
                                           const ResumePoint& point);

// "goes on after observation 12 of ius and 3 of camera, update 14"
std::string describe(const ResumePoint& point);

}  // namespace brainshift::client
