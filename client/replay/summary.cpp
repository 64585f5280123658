// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <string>
#include <vector>

#include "client/replay/replay.hpp"

namespace brainshift::client {

void summarise(const PlayedSession& session, RunReport& run) {
  std::vector<double> latency;
  std::vector<double> first_iterate;
  std::vector<StageTimings> timings;
  for (const PlayedObservation& observation : session.observations) {
    if (observation.error) {
      run.failures.push_back({observation.sequence, std::string(to_string(observation.error->code)),
                              observation.error->message});
    }
    run.superseded += observation.superseded ? 1 : 0;
    if (!observation.latency_ms) continue;
    latency.push_back(*observation.latency_ms);
    timings.push_back(observation.timings);
    if (observation.first_iterate_ms) first_iterate.push_back(*observation.first_iterate_ms);
  }
  run.updates = static_cast<int>(latency.size());
  if (latency.empty()) return;

  run.cold_ms = latency.front();
  if (latency.size() > 1) latency.erase(latency.begin());
  run.latency_ms = LatencyPercentiles{percentile(latency, 50), percentile(latency, 95),
                                      percentile(latency, 99), percentile(latency, 100)};
  if (!first_iterate.empty()) run.first_iterate_ms = percentile(first_iterate, 50);
  const auto median = [&timings](double StageTimings::*stage) {
    std::vector<double> values;
    for (const StageTimings& t : timings) values.push_back(t.*stage);
    return percentile(values, 50);
  };
  run.stages_ms = StageMedians{median(&StageTimings::register_ms), median(&StageTimings::invert_ms),
                               median(&StageTimings::rebuild_ms), median(&StageTimings::encode_ms),
                               median(&StageTimings::journal_ms)};
}

std::vector<TracePoint> trace_of(
    const PlayedSession& session,
    const std::function<std::optional<MeanStd>(const Points&)>& cross_of) {
  std::vector<TracePoint> trace;
  if (!session.last) return trace;
  for (const IterationRecord& record : session.last->estimate.history) {
    TracePoint point{record.iteration,   record.misfit_mm,          std::nullopt,
                     record.penetrating, record.max_penetration_mm, record.elapsed_ms};
    const auto iterate =
        std::find_if(session.iterates.begin(), session.iterates.end(),
                     [&](const Iterate& it) { return it.iteration == record.iteration; });
    if (iterate != session.iterates.end()) point.cross = cross_of(iterate->displacement);
    trace.push_back(point);
  }
  return trace;
}

}  // namespace brainshift::client
