// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/journal/record_ranges.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace brainshift::server {
namespace {

std::string sequences(const SequenceRange& range) {
  return range.first == range.last ? fmt::format("{}", range.first)
                                   : fmt::format("{} to {}", range.first, range.last);
}

}  // namespace

void SequenceRange::add(const SequenceRange& other) {
  if (other.count == 0) return;
  first = count == 0 ? other.first : std::min(first, other.first);
  last = count == 0 ? other.last : std::max(last, other.last);
  count += other.count;
}

void RecordRanges::add(io::RecordKind kind, const std::string& source, std::uint64_t sequence) {
  const SequenceRange one{sequence, sequence, 1};
  if (kind == io::RecordKind::kObservation) observations[source].add(one);
  if (kind == io::RecordKind::kUpdate) updates.add(one);
}

void RecordRanges::add(const RecordRanges& other) {
  for (const auto& [source, range] : other.observations) observations[source].add(range);
  updates.add(other.updates);
}

std::string describe(const RecordRanges& ranges) {
  std::string text;
  const auto append = [&](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  for (const auto& [source, range] : ranges.observations) {
    append(fmt::format("observations {} of {} ({})", sequences(range), source, range.count));
  }
  if (ranges.updates.count > 0) {
    append(fmt::format("updates {} ({})", sequences(ranges.updates), ranges.updates.count));
  }
  return text.empty() ? "nothing" : text;
}

}  // namespace brainshift::server
