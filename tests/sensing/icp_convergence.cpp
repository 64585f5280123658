// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <cstdio>
#include <string>

#include "common/registration/icp.hpp"
#include "tests/sensing/icp_study.hpp"
#include "tests/sensing/tumour_points.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::sensing {
namespace {

using test_support::record;
using test_support::record_check;

constexpr double kTranslation_mm = 10.0, kRotation_deg = 15.0;
constexpr double kNoise_mm = 0.3;
constexpr double kFound_mm = 1.0;  // largest error over the surface's vertices
constexpr int kPoints = 1000;

registration::IcpOptions without_prior() {
  registration::IcpOptions options;
  options.sd_mm = kNoise_mm;
  options.rotation_sd_deg = 0.0;  // starts are not drawn from it
  return options;
}

struct Trials {
  int found = 0, count = 0, converged = 0;
  double mean_iterations = 0.0;
  double percent() const { return 100.0 * found / count; }
};

Trials run(const IndexedSurface& tumour, double scale, int count, std::uint64_t seed) {
  Random random(seed);
  Trials trials;
  for (; trials.count < count; ++trials.count) {
    const RigidTransform T_points_surface =
        random_motion(scale * kTranslation_mm, scale * kRotation_deg, random);
    const Points points = measured(section_points(tumour.surface, kPoints, random),
                                   T_points_surface, kNoise_mm, true, random);
    const auto result =
        registration::align(points, tumour.volume, RigidTransform::Identity(), without_prior());
    if (!result) continue;
    const double error = largest_error_mm(result->T_surface_points, T_points_surface.inverse(),
                                          tumour.surface.vertices);
    trials.found += error < kFound_mm ? 1 : 0;
    trials.converged += result->converged ? 1 : 0;
    trials.mean_iterations += static_cast<double>(result->iterations) / count;
  }
  return trials;
}

}  // namespace

void study_icp_convergence() {
  const IndexedSurface tumour = indexed(tumour_surface());
  for (const double scale : {0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0}) {
    const Trials trials = run(tumour, scale, scale == 1.0 ? 1000 : 200, 20);
    std::printf("icp: start %.1f mm and %.1f deg: %d of %d found, %d settled, %.1f iterations\n",
                scale * kTranslation_mm, scale * kRotation_deg, trials.found, trials.count,
                trials.converged, trials.mean_iterations);
    record({"icp_convergence", "10 % outliers; 1000 points of eight sections",
            "start error mm; 1.5 deg with each mm", "poses found %", scale * kTranslation_mm,
            trials.percent()});
    if (scale == 1.0)
      record_check("icp_convergence",
                   "poses found from 10 mm and 15 deg with 10 % outliers: largest error < 1 mm (%)",
                   trials.percent(), ">= 99 %", trials.percent() >= 99.0,
                   "1000 random trials against the known pose");
  }
}

void study_icp_sphere() {
  const IndexedSurface sphere =
      indexed(geometry::ellipsoid_surface(kTumourCentre, Vec3::Constant(14.0), 1.05));
  Random random(7);
  int aligned = 0, shown = 0;
  double turned = 0.0;
  constexpr int kTrials = 100;
  std::string words;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Points points = measured(section_points(sphere.surface, kPoints, random),
                                   random_motion(5.0, 8.0, random), kNoise_mm, true, random);
    const auto result =
        registration::align(points, sphere.volume, RigidTransform::Identity(), without_prior());
    if (!result) continue;
    ++aligned;
    shown += result->rotation_observable ? 1 : 0;
    turned = std::max(turned, Eigen::AngleAxisd(result->T_surface_points.linear()).angle());
    for (const std::string& sentence : registration::not_shown(result->observability))
      words = sentence;
  }
  const double turned_deg = turned * 180.0 / std::numbers::pi;
  std::printf(
      "icp: sphere: rotation reported as shown %d times in %d; turned by %.2g deg; \"%s\"\n", shown,
      aligned, turned_deg, words.c_str());
  // A trial without a result shows nothing, so all must have one.
  const bool all = aligned == kTrials;
  record_check("icp_convergence", "spheres whose rotation is said to be shown (of 100)", shown, "0",
               all && shown == 0, "symmetry");
  record_check("icp_convergence", "largest rotation given to a sphere (deg)", turned_deg, "<= 0.01",
               all && turned_deg <= 0.01, "symmetry");
}

}  // namespace brainshift::sensing
