// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/held_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace brainshift::client {
namespace {

using Samples = std::vector<TipSample>;

constexpr double kLeftOutAtEitherEnd = 0.1;

// Samples [first, end), which all lie in one hold.
struct Run {
  std::size_t first = 0, end = 0;
};

Vec3 mean_of(const Samples& samples, const Run& run) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = run.first; i < run.end; ++i) sum += samples[i].tip;
  return sum / static_cast<double>(run.end - run.first);
}

double duration_s(const Samples& samples, const Run& run) {
  return samples[run.end - 1].time_s - samples[run.first].time_s;
}

// The longest run from `first` on.
Run run_from(const Samples& samples, std::size_t first, const HoldOptions& options) {
  Run run{first, first + 1};
  Vec3 sum = samples[first].tip;
  while (run.end < samples.size()) {
    const TipSample& next = samples[run.end];
    if (next.time_s - samples[run.end - 1].time_s > options.gap_s) break;
    const Vec3 mean = (sum + next.tip) / static_cast<double>(run.end + 1 - first);
    const auto far = [&](const TipSample& sample) {
      return (sample.tip - mean).norm() > options.radius_mm;
    };
    const auto begin = samples.begin() + static_cast<std::ptrdiff_t>(first);
    if (std::any_of(begin, samples.begin() + static_cast<std::ptrdiff_t>(run.end + 1), far)) break;
    sum += next.tip;
    ++run.end;
  }
  return run;
}

// Runs of one hold, which may be several that noise cut apart.
HeldPoint held_point(const Samples& samples, const std::vector<Run>& runs) {
  std::vector<Vec3> tips;
  for (const Run& run : runs) {
    for (std::size_t i = run.first; i < run.end; ++i) tips.push_back(samples[i].tip);
  }
  const auto cut =
      static_cast<std::ptrdiff_t>(kLeftOutAtEitherEnd * static_cast<double>(tips.size()));
  const std::vector<Vec3> middle(tips.begin() + cut, tips.end() - cut);
  HeldPoint held;
  held.from_s = samples[runs.front().first].time_s;
  held.to_s = samples[runs.back().end - 1].time_s;
  held.poses = static_cast<int>(middle.size());
  for (const Vec3& tip : middle) held.tip += tip / static_cast<double>(middle.size());
  double sum = 0.0;
  for (const Vec3& tip : middle) sum += (tip - held.tip).squaredNorm();
  held.spread_mm = std::sqrt(sum / static_cast<double>(middle.size()));
  return held;
}

Status check(const Samples& samples, const HoldOptions& options) {
  for (const auto& [name, value] :
       {std::pair{"radius_mm", options.radius_mm}, std::pair{"least_s", options.least_s},
        std::pair{"gap_s", options.gap_s}}) {
    if (!(std::isfinite(value) && value > 0.0)) {
      return invalid(fmt::format("{} = {}: must be > 0", name, value));
    }
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!samples[i].tip.allFinite() || !std::isfinite(samples[i].time_s)) {
      return fail(ErrorCode::kNotFinite, fmt::format("pose {} of the tip is not finite", i));
    }
  }
  return {};
}

}  // namespace

Result<std::vector<HeldPoint>> find_holds(const Samples& samples, const HoldOptions& options) {
  if (Status ok = check(samples, options); !ok) return tl::unexpected(ok.error());
  std::vector<std::vector<Run>> holds;
  for (std::size_t at = 0; at < samples.size();) {
    const Run run = run_from(samples, at, options);
    if (duration_s(samples, run) < options.least_s) {
      ++at;
      continue;
    }
    const Vec3 mean = mean_of(samples, run);
    if (!holds.empty() &&
        (mean_of(samples, holds.back().back()) - mean).norm() <= 2.0 * options.radius_mm) {
      holds.back().push_back(run);
    } else {
      holds.push_back({run});
    }
    at = run.end;
  }
  std::vector<HeldPoint> points;
  for (const auto& runs : holds) points.push_back(held_point(samples, runs));
  return points;
}

}  // namespace brainshift::client
