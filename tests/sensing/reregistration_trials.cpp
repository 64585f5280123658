// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/sensing/reregistration_trials.hpp"

#include <algorithm>
#include <numbers>

#include "common/core/stopwatch.hpp"
#include "common/core/thread_team.hpp"
#include "common/registration/pose_information.hpp"

namespace brainshift::sensing {
namespace {

constexpr double kMostTurn_deg = 8.0;
constexpr double kFullTurnFrom_mm = 5.0;
constexpr double kTrusted = 0.5;

}  // namespace

double target_error_mm(const RigidTransform& T, const TriangleSurface& tumour) {
  const Points off =
      ((T.linear() * tumour.vertices).colwise() + Vec3(T.translation())) - tumour.vertices;
  return off.colwise().norm().mean();
}

RigidTransform random_start(double error_mm, const TriangleSurface& tumour, Random& random) {
  const Vec3 centre = tumour.vertices.rowwise().mean();
  const double turn = kMostTurn_deg * std::numbers::pi / 180.0 * random.uniform() *
                      std::min(1.0, error_mm / kFullTurnFrom_mm);
  registration::Vec6 xi;
  xi << turn * random.direction(), Vec3::Zero();
  const Vec3 direction = random.direction();
  double low = 0.0, high = 2.0 * error_mm;
  for (int halving = 0; halving < 40; ++halving) {
    const double middle = 0.5 * (low + high);
    xi.tail<3>() = middle * direction;
    (target_error_mm(registration::rigid_increment(xi, centre), tumour) < error_mm ? low : high) =
        middle;
  }
  return registration::rigid_increment(xi, centre);
}

TrialSummary summarise(const std::vector<Trial>& trials) {
  TrialSummary summary;
  summary.count = static_cast<int>(trials.size());
  const double percent = 100.0 / summary.count;
  int answered = 0;
  for (const Trial& trial : trials) {
    const bool found = !trial.refused && trial.after_mm < kFound_mm;
    const bool trusted = !trial.refused && trial.agreement >= kTrusted;
    summary.found_percent += found ? percent : 0.0;
    summary.refused_percent += trial.refused ? percent : 0.0;
    summary.trusted_percent += trusted ? percent : 0.0;
    summary.trusted_wrong_percent += trusted && !found ? percent : 0.0;
    summary.mean_before_mm += trial.before_mm / summary.count;
    summary.mean_seconds += trial.seconds / summary.count;
    if (trial.refused) continue;
    ++answered;
    summary.mean_after_mm += trial.after_mm;
    summary.largest_after_mm = std::max(summary.largest_after_mm, trial.after_mm);
  }
  if (answered > 0) summary.mean_after_mm /= answered;
  return summary;
}

std::vector<Trial> run_trials(const Method& method, double error_mm, int count, std::uint64_t seed,
                              const TriangleSurface& tumour, int threads) {
  Random random(seed);
  std::vector<RigidTransform> starts;
  for (int i = 0; i < count; ++i) starts.push_back(random_start(error_mm, tumour, random));
  std::vector<Trial> trials(starts.size());
  ThreadTeam team(threads);
  team.split(count, [&](long begin, long end) {
    for (long i = begin; i < end; ++i) {
      const auto at = static_cast<std::size_t>(i);
      Trial& trial = trials[at];
      trial.before_mm = target_error_mm(starts[at], tumour);
      const Stopwatch watch;
      const Answer answer = method(starts[at]);
      trial.seconds = watch.seconds();
      trial.refused = answer.refused;
      trial.agreement = answer.agreement;
      trial.after_mm = answer.refused ? trial.before_mm
                                      : target_error_mm(answer.T_correction * starts[at], tumour);
    }
  });
  return trials;
}

}  // namespace brainshift::sensing
