// SPDX-License-Identifier: GPL-3.0-or-later
// RecordRanges: which observations and updates a set of records holds, as one range of sequences
// for each source and one for the updates. Decisions are about these and are not counted.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/io/recording/surgery_record.hpp"

namespace brainshift::server {

struct SequenceRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  std::uint64_t count = 0;  // 0: empty; below last - first + 1 where numbers were left out

  void add(const SequenceRange& other);
  bool operator==(const SequenceRange&) const = default;
};

struct RecordRanges {
  std::map<std::string, SequenceRange> observations;  // by source
  SequenceRange updates;

  void add(io::RecordKind kind, const std::string& source, std::uint64_t sequence);
  void add(const RecordRanges& other);
  bool empty() const { return observations.empty() && updates.count == 0; }
};

// "observations 5 to 9 of ius (5), updates 3 to 7 (4)"; "nothing" when empty.
std::string describe(const RecordRanges& ranges);

}  // namespace brainshift::server
