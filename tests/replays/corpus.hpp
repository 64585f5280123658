// SPDX-License-Identifier: GPL-3.0-or-later
// The corpus that `make replays` plays: five surgeries of 15 to 20 different observations each,
// made from seeds by the twin. None is there twice: the fluid falls from moment to moment.
//
// Two clocks. An observation is acquired as its scenario says (moments 30 or 300 s apart), and
// that decides how old the data of a source are (sensing.max_age_s). It is recorded, and played at
// 1x, in time lapse: a moment's instruments kBetween_s apart, and moments so far apart that an
// observation has kPerObservation_s on average. No operating room is faster.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/tools/replay/play.hpp"
#include "client/tools/twin/scenario.hpp"
#include "client/tools/twin/surgery.hpp"
#include "common/core/error.hpp"
#include "common/io/recording/surgery_record.hpp"

namespace brainshift::replays {

inline constexpr double kPerObservation_s = 0.75;
inline constexpr double kBetween_s = 0.25;

struct CorpusSurgery {
  std::string name;           // of its file
  client::Scenario scenario;  // of the twin, with the moments of this corpus
  std::uint64_t seed = 0;
};

// In the order in which they are played.
const std::vector<CorpusSurgery>& corpus();

// What a recorder would have kept: the observations of a played scenario, recorded in time lapse.
// Precondition: every moment has the same number of observations, moments as many as the scenario.
std::vector<client::RecordedObservation> record(const client::SimulatedSurgery& surgery,
                                                std::size_t moments);

// A surgery file without truth. kWriteFailed when it exists or cannot be written; nothing is left
// behind then.
Status write_recording(const std::filesystem::path& path, const io::SurgeryMeta& meta,
                       const std::vector<client::RecordedObservation>& recording);

struct Recording {
  io::SurgeryMeta meta;
  std::vector<client::RecordedObservation> observations;  // not empty
};
// kNotFound, kUnreadable; kEmptySet without an observation.
Result<Recording> read_recording(const std::filesystem::path& path);

// What the corpus holds, in a table small enough to be committed: corpus-CASE.csv. A corpus that is
// made anew is compared with it, so that times of other observations are not taken for those of the
// same ones.
//
// Another processor's arithmetic changes the last digits of a simulated observation, and so its
// checksum. Two sums that every coordinate enters tell that from a changed observation:
//   mean_mm     mean of all coordinates c_1, c_2, ... c_n
//   ordered_mm  (1/n) sum_k cos(k) c_k, which also changes with their order
// tests/studies/replays.py compares.
struct ManifestEntry {
  std::string surgery;
  std::uint64_t seed = 0;
  std::uint64_t sequence = 0;
  std::string source;
  std::int64_t recorded_ns = 0, acquired_ns = 0;
  std::uint64_t coordinates = 0;
  double mean_mm = 0.0, ordered_mm = 0.0;
  std::uint32_t crc32 = 0;  // of the encoded observation (common/wire)
};

ManifestEntry entry_of(const std::string& surgery, std::uint64_t seed,
                       const client::RecordedObservation& recorded);

// kWriteFailed; an existing file is replaced.
Status write_manifest(const std::filesystem::path& path, const std::vector<ManifestEntry>& entries);

}  // namespace brainshift::replays
