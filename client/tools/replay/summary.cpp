// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "client/tools/replay/replay.hpp"

namespace brainshift::client {
namespace {

RunQuality quality_of(const std::vector<const QualityVerdict*>& verdicts) {
  RunQuality quality;
  QualityCounts& counts = quality.counts;
  for (const QualityVerdict* verdict : verdicts) {
    switch (verdict->quality) {
      case Quality::kNotJudged: ++counts.not_judged; break;
      case Quality::kGood: ++counts.good; break;
      case Quality::kCaution: ++counts.caution; break;
      case Quality::kUnusable: ++counts.unusable; break;
    }
    for (const QualityFlag flag : kAllQualityFlags) {
      if (verdict->flags.has(flag)) ++quality.flags[std::string(to_string(flag))];
    }
  }
  const Quality worst = counts.unusable > 0     ? Quality::kUnusable
                        : counts.not_judged > 0 ? Quality::kNotJudged
                        : counts.caution > 0    ? Quality::kCaution
                                                : Quality::kGood;
  quality.worst = to_string(worst);
  quality.last = to_string(verdicts.back()->quality);
  quality.reason = verdicts.back()->reason;
  return quality;
}

}  // namespace

void summarise(const PlayedSession& session, RunReport& run) {
  std::vector<double> latency;
  std::vector<double> first_iterate;
  std::vector<StageTimings> timings;
  std::vector<const QualityVerdict*> verdicts;
  for (const PlayedObservation& observation : session.observations) {
    if (observation.error) {
      run.failures.push_back({observation.sequence, std::string(to_string(observation.error->code)),
                              observation.error->message});
    }
    run.superseded += observation.superseded ? 1 : 0;
    if (!observation.latency_ms) continue;
    latency.push_back(*observation.latency_ms);
    timings.push_back(observation.timings);
    verdicts.push_back(&observation.quality);
    run.status = to_string(observation.status);  // describe() names the last usable one's
    if (observation.first_iterate_ms) first_iterate.push_back(*observation.first_iterate_ms);
  }
  run.updates = static_cast<int>(latency.size());
  if (latency.empty()) return;
  run.quality = quality_of(verdicts);

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

std::string summary_line(const RunReport& run) {
  std::string line = run.scenario + ", " + run.method + ", " + run.boundary + ": " +
                     std::to_string(run.updates) + (run.updates == 1 ? " update" : " updates");
  if (run.quality) {
    const QualityCounts& counts = run.quality->counts;
    const std::pair<int, const char*> verdicts[] = {{counts.good, "good"},
                                                    {counts.caution, "with caution"},
                                                    {counts.unusable, "unusable"},
                                                    {counts.not_judged, "not judged"}};
    std::string list;
    for (const auto& [count, words] : verdicts) {
      if (count > 0) list += (list.empty() ? "" : ", ") + std::to_string(count) + " " + words;
    }
    line += " (" + list + ")";
    std::string flags;
    for (const auto& [flag, count] : run.quality->flags) {
      flags += (flags.empty() ? "; " : ", ") + flag + " " + std::to_string(count);
    }
    line += flags;
  }
  if (!run.failures.empty()) line += "; " + std::to_string(run.failures.size()) + " failed";
  if (run.recovery_pct) {
    char text[64];
    std::snprintf(text, sizeof text, "; %.1f %% recovered at the tumour", *run.recovery_pct);
    line += text;
  }
  return line;
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
