// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

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
  for (const QualityFlag flag : kAllQualityFlags) {
    if (verdicts.back()->flags.has(flag)) quality.last_flags.emplace_back(to_string(flag));
  }
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
  run.stages_ms.emplace();
  for (const auto stage :
       {&StageTimings::register_ms, &StageTimings::invert_ms, &StageTimings::rebuild_ms,
        &StageTimings::encode_ms, &StageTimings::journal_ms}) {
    std::vector<double> values;
    for (const StageTimings& t : timings) values.push_back(t.*stage);
    *run.stages_ms.*stage = percentile(values, 50);
  }
}

std::string summary_line(const RunReport& run) {
  std::string line = fmt::format("{}, {}, {}: {} update{}", run.scenario, run.method, run.boundary,
                                 run.updates, run.updates == 1 ? "" : "s");
  if (run.quality) {
    const QualityCounts& counts = run.quality->counts;
    std::vector<std::string> verdicts, flags;
    for (const auto& [count, words] :
         {std::pair{counts.good, "good"}, std::pair{counts.caution, "with caution"},
          std::pair{counts.unusable, "unusable"}, std::pair{counts.not_judged, "not judged"}}) {
      if (count > 0) verdicts.push_back(fmt::format("{} {}", count, words));
    }
    for (const auto& [flag, count] : run.quality->flags) {
      flags.push_back(fmt::format("{} {}", flag, count));
    }
    line += fmt::format(" ({})", fmt::join(verdicts, ", "));
    if (!flags.empty()) line += fmt::format("; {}", fmt::join(flags, ", "));
  }
  if (!run.failures.empty()) line += fmt::format("; {} failed", run.failures.size());
  if (run.recovery_pct)
    line += fmt::format("; {:.1f} % recovered at the tumour", *run.recovery_pct);
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

std::string latency_csv(const PlayedSession& session) {
  std::string text =
      "update,observation_sequence,latency_ms,register_ms,invert_ms,rebuild_ms,encode_ms,active,"
      "contact_iterations,status\n";
  std::size_t update = 0;
  for (const PlayedObservation& observation : session.observations) {
    text += fmt::format("{},{},", ++update, observation.sequence);
    if (observation.latency_ms) {
      const StageTimings& t = observation.timings;  // to a tenth of a microsecond
      text += fmt::format("{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{}\n", *observation.latency_ms,
                          t.register_ms, t.invert_ms, t.rebuild_ms, t.encode_ms, observation.active,
                          observation.contact_iterations, to_string(observation.status));
    } else {
      text += fmt::format(",,,,,,,{}\n",
                          observation.error ? to_string(observation.error->code) : "superseded");
    }
  }
  return text;
}

}  // namespace brainshift::client
