// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/operations/counters.hpp"

#include <algorithm>
#include <memory>

namespace brainshift::server {
namespace {

double milliseconds(Counters::TimePoint::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

}  // namespace

Counters::Row& Counters::row(std::string_view source) {
  const auto found = std::find_if(rows_.begin(), rows_.end(),
                                  [&](const Row& known) { return known.counts.source == source; });
  return found == rows_.end() ? unnamed_ : *found;
}

Counters::Row& Counters::receive(Row& row, TimePoint now) {
  ++row.counts.received;
  row.last = now;
  return row;
}

void Counters::accepted(std::string_view source, TimePoint now) {
  const std::lock_guard lock(mutex_);
  Row* at = &row(source);
  if (at == &unnamed_ && !source.empty() && rows_.size() < kMaxSources) {
    at = &rows_.emplace_back();
    at->counts.source = source;
  }
  ++receive(*at, now).counts.waiting;
}

void Counters::refused(std::string_view source, TimePoint now) {
  const std::lock_guard lock(mutex_);
  ++receive(row(source), now).counts.refused;
}

void Counters::repeated(std::string_view source, TimePoint now) {
  const std::lock_guard lock(mutex_);
  ++receive(row(source), now).counts.repeated;
}

void Counters::decided(const Decision& decision) {
  const std::lock_guard lock(mutex_);
  wire::SourceCounts& counts = row(decision.source).counts;
  --counts.waiting;
  switch (decision.outcome) {
    case Outcome::kUsed: ++counts.answered; break;
    case Outcome::kFailed: ++counts.failed; break;
    case Outcome::kSuperseded: ++counts.replaced; break;
    case Outcome::kSkipped: ++counts.skipped; break;
  }
}

void Counters::answered(const Passage& passage) {
  const StageTimings& timings = passage.timings;
  const std::array<double, kStages.size()> stages_ms = {
      milliseconds(passage.begun - passage.arrived),
      timings.register_ms,
      timings.invert_ms,
      timings.rebuild_ms,
      timings.encode_ms,
      timings.journal_ms,
      milliseconds(passage.published - passage.arrived)};
  const std::lock_guard lock(mutex_);
  ++(passage.usable ? usable_ : unusable_);
  if (passage.late) ++late_;
  for (std::size_t i = 0; i < stages_.size(); ++i) stages_[i].add(stages_ms[i]);
}

void Counters::failed() {
  const std::lock_guard lock(mutex_);
  ++failures_;
}

void Counters::iterate() {
  const std::lock_guard lock(mutex_);
  ++iterates_;
}

void Counters::report(wire::DaemonReport& report, TimePoint now) const {
  const auto stages = std::make_unique<Stages>();
  std::vector<Row> rows;
  {
    const std::lock_guard lock(mutex_);
    report.usable = usable_;
    report.unusable = unusable_;
    report.late = late_;
    report.failures = failures_;
    report.iterates = iterates_;
    rows = rows_;
    if (unnamed_.counts.received > 0) rows.push_back(unnamed_);
    *stages = stages_;
  }
  for (Row& row : rows) {
    row.counts.age_ms = std::max(0.0, milliseconds(now - row.last));
    report.sources.push_back(std::move(row.counts));
  }
  report.recent_updates = LatencyRecord::kRecent;
  report.bounds_ms.assign(LatencyRecord::kBounds_ms.begin(), LatencyRecord::kBounds_ms.end());
  for (std::size_t i = 0; i < stages->size(); ++i) {
    const LatencyRecord& record = (*stages)[i];
    report.stages.push_back({kStages[i],
                             record.recent(),
                             record.all(),
                             record.sum_ms(),
                             {record.buckets().begin(), record.buckets().end()}});
  }
}

}  // namespace brainshift::server
