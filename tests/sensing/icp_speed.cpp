// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "common/contact/forward_model.hpp"
#include "common/core/statistics.hpp"
#include "common/core/stopwatch.hpp"
#include "common/linalg/openblas.hpp"
#include "common/patient/read_patient.hpp"
#include "common/registration/icp.hpp"
#include "tests/sensing/icp_study.hpp"
#include "tests/sensing/tumour_points.hpp"
#include "tests/support/study_record.hpp"
#ifdef BRAINSHIFT_WITH_PCL
#include "tests/sensing/pcl_icp.hpp"
#endif

namespace brainshift::sensing {
namespace {

using test_support::record_check;
using test_support::record_figure;
using test_support::record_left_out;

constexpr int kTrials = 31;
constexpr int kSpeedPoints = 4000;
constexpr double kSpeedNoise_mm = 0.3;

double milliseconds_of(const std::function<void()>& work) {
  const Stopwatch watch;
  work();
  return watch.milliseconds();
}

// Points of the whole surface with noise, 5 mm and 8 degrees off.
std::vector<Points> trials_on(const TriangleSurface& surface) {
  std::vector<Points> trials;
  Random random(3);
  for (int trial = 0; trial < kTrials; ++trial)
    trials.push_back(measured(geometry::sample_surface(surface, kSpeedPoints, 100 + trial),
                              random_motion(5.0, 8.0, random), kSpeedNoise_mm, false, random));
  return trials;
}

// Of the points where a pose puts them, to the triangles.
double exact_rms_mm(const Points& points, const RigidTransform& T,
                    const geometry::ClosestPointIndex& index) {
  double sum = 0.0;
  for (const Vec3 x : points.colwise()) sum += std::pow(index.closest(T * x).distance_mm, 2);
  return std::sqrt(sum / static_cast<double>(points.cols()));
}

struct Method {
  std::vector<double> times_ms, rms_mm;
  double p50_ms() const { return percentile(times_ms, 50.0); }
  double mean_rms_mm() const { return mean_std(rms_mm).mean; }
};

void print(const char* name, const Method& method) {
  std::printf("icp: %-60s p50 %8.3f ms  p95 %8.3f ms  residual %.6f mm rms\n", name,
              method.p50_ms(), percentile(method.times_ms, 95.0), method.mean_rms_mm());
}

using registration::TargetSurface;

registration::IcpResult align(const Points& points, const TargetSurface& surface) {
  registration::IcpOptions options;
  options.sd_mm = kSpeedNoise_mm;
  options.rotation_sd_deg = 0.0;
  return registration::align(points, surface, RigidTransform::Identity(), options).value();
}

void add_trial(const Points& points, const TargetSurface& surface,
               const geometry::ClosestPointIndex& index, Method& method) {
  registration::IcpResult result;
  method.times_ms.push_back(milliseconds_of([&] { result = align(points, surface); }));
  method.rms_mm.push_back(exact_rms_mm(points, result.T_surface_points, index));
}

Method measure(const std::vector<Points>& trials, const TargetSurface& surface,
               const geometry::ClosestPointIndex& index) {
  Method method;
  for (const Points& points : trials) add_trial(points, surface, index, method);
  return method;
}

// Solves and alignments by turns, so that both see the same machine.
void compare_with_solve(const contact::ForwardModel& forward, int nodes,
                        const std::vector<Points>& trials,
                        const geometry::DistanceVolume& surface) {
  const VecX b = VecX::LinSpaced(forward.dofs().num_unknowns(), -1.0, 1.0);
  VecX x;
  std::vector<double> solves_ms, alignments_ms;
  for (const Points& points : trials) {
    solves_ms.push_back(milliseconds_of([&] { forward.factor().solve(b, x); }));
    alignments_ms.push_back(milliseconds_of([&] { (void)align(points, surface); }));
  }
  const double solve_ms = percentile(solves_ms, 50.0);
  const double align_ms = percentile(alignments_ms, 50.0);
  std::printf("icp: forward solve of %d nodes p50 %.2f ms; alignment beside it p50 %.2f ms\n",
              nodes, solve_ms, align_ms);
  record_check("icp_speed", "alignment of 4000 points over a forward solve of the default head",
               align_ms / solve_ms, "<= 0.2", align_ms <= 0.2 * solve_ms, "p50 of the same run");
}

void compare_with_head(const std::vector<Points>& trials, const geometry::DistanceVolume& surface) {
  const auto head = patient::read_patient(BRAINSHIFT_DEFAULT_CASE);
  if (!head) return record_left_out("icp_speed", "default head: " + head.error().message);
  const auto forward = contact::ForwardModel::build(head->model, head->config, Boundary::kContact);
  if (!forward) return record_left_out("icp_speed", "default head: " + forward.error().message);
  compare_with_solve(*forward, head->model.mesh.num_nodes(), trials, surface);
}

#ifdef BRAINSHIFT_WITH_PCL
// PCL and ours by turns, so that both see the same machine.
void compare_with_pcl(const std::vector<Points>& trials, const IndexedSurface& tumour, bool plane,
                      int max_iterations) {
  PclIcp icp(tumour.surface, geometry::vertex_normals(tumour.surface), plane, max_iterations);
  Method pcl, ours;
  for (const Points& points : trials) {
    double align_ms = 0.0;
    const RigidTransform T = icp.align(points, align_ms);
    pcl.times_ms.push_back(align_ms);
    pcl.rms_mm.push_back(exact_rms_mm(points, T, tumour.index));
    add_trial(points, tumour.volume, tumour.index, ours);
  }
  const std::string name = std::string("PCL IterativeClosestPoint") + (plane ? "WithNormals" : "") +
                           " (up to " + std::to_string(max_iterations) + " iterations)";
  print(name.c_str(), pcl);
  const double ratio = pcl.p50_ms() / ours.p50_ms();
  const double residuals = ours.mean_rms_mm() / pcl.mean_rms_mm();
  const std::string source = "same data by turns; residual to the triangles by exact search";
  // The goal is ten times against point to point. Point to plane is the same problem as ours, like
  // for like; its ratio is shown without a bound.
  if (plane)
    record_figure("icp_speed", "time of " + name + " over ours", ratio, "shown", source);
  else
    record_check("icp_speed", "time of " + name + " over ours", ratio, ">= 10", ratio >= 10.0,
                 source);
  record_check("icp_speed", "residual rms of ours over that of " + name, residuals, "<= 1",
               residuals <= 1.0, source);
}
#endif

}  // namespace

void study_icp_speed() {
  linalg::use_single_threaded_blas();
  const TriangleSurface surface = tumour_surface();
  auto index = geometry::ClosestPointIndex::build(surface).value();
  DistanceGrid grid;
  const double grid_ms =
      milliseconds_of([&] { grid = geometry::signed_distance_grid(index).value(); });
  std::printf("icp: %d triangles; distance grid of %zu nodes built in %.0f ms\n",
              surface.num_triangles(), grid.num_nodes(), grid_ms);
  const IndexedSurface tumour{surface, std::move(index),
                              geometry::DistanceVolume::create(std::move(grid)).value()};
  const std::vector<Points> trials = trials_on(surface);
  const Method ours = measure(trials, tumour.volume, tumour.index);
  print("ours on interpolated distances", ours);
  const Method searched = measure(trials, tumour.index, tumour.index);
  print("ours on searched triangles", searched);
  const double loss = ours.mean_rms_mm() / searched.mean_rms_mm() - 1.0;
  record_check("icp_speed", "residual rms lost by interpolating distances (%)", 100.0 * loss,
               "<= 0.01 %", loss <= 1e-4, "the same alignment with exact distances");
  record_check("icp_speed", "time to make the distance grid (s)", 1e-3 * grid_ms, "<= 5 s",
               grid_ms <= 5000.0, "once per patient");
#ifdef BRAINSHIFT_WITH_PCL
  for (const bool plane : {false, true})
    for (const int max_iterations : {10, 100})
      compare_with_pcl(trials, tumour, plane, max_iterations);
#else
  record_left_out("icp_speed", "comparison with the Point Cloud Library: libpcl-dev not found");
#endif
  compare_with_head(trials, tumour.volume);
}

}  // namespace brainshift::sensing
