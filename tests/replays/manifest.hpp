// SPDX-License-Identifier: GPL-3.0-or-later
// What the corpus holds, in a table small enough to be committed: corpus-CASE.csv. A corpus that is
// made anew is compared with it, so that times of other observations are not taken for those of the
// same ones.
//
// Another processor's arithmetic changes the last digits of a simulated observation, and so its
// checksum. Two sums that every coordinate enters tell that from a changed observation:
//   mean_mm     mean of all coordinates c_1, c_2, ... c_n
//   ordered_mm  (1/n) sum_k cos(k) c_k, which also changes with their order
// tests/studies/replays.py compares.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/tools/replay/play.hpp"
#include "common/core/error.hpp"

namespace brainshift::replays {

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
