// SPDX-License-Identifier: GPL-3.0-or-later
// What a client pays to ask where a point is and where it was (client/lib/field.hpp): building the
// mesh once per model, a point after it, and how exact the way back is.
//   build/release/bin/bench_field model.h5
//
// The field is made up: a sag of 10 mm that fades over 40 mm from the tumour. One thread; points at
// random in the brain's box, those inside count.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "client/lib/field.hpp"
#include "common/io/model/model_file.hpp"
#include "tests/benchmarks/tools.hpp"

namespace brainshift {
namespace {

using bench::value_or_exit;
using Clock = std::chrono::steady_clock;

constexpr int kPoints = 200000;

double seconds(Clock::time_point since) {
  return std::chrono::duration<double>(Clock::now() - since).count();
}

int run(const char* path) {
  const auto file = value_or_exit(io::read_model(path, {}));
  const BrainModel& model = file.model;
  auto begin = Clock::now();
  const auto mesh = value_or_exit(client::FieldMesh::build(model));
  const double build_ms = 1e3 * seconds(begin);

  Update update;
  update.model_id = model.model_id;
  update.case_id = model.case_id;
  update.final = true;
  Estimate& estimate = update.estimate;
  estimate.quality.quality = Quality::kGood;
  const Points& nodes = model.mesh.nodes;
  const Vec3 tumour = model.tumour.vertices.rowwise().mean();
  estimate.displacement = Points::Zero(3, nodes.cols());
  for (Eigen::Index n = 0; n < nodes.cols(); ++n) {
    estimate.displacement(2, n) = -10.0 * std::exp(-(nodes.col(n) - tumour).norm() / 40.0);
  }
  estimate.sd_mm = VecX::Constant(nodes.cols(), 0.3);
  const auto field = value_or_exit(client::Field::of(mesh, update));

  std::mt19937 random(1);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  const Vec3 low = nodes.rowwise().minCoeff(), high = nodes.rowwise().maxCoeff();
  Points points(3, kPoints);
  for (auto x : points.colwise()) {
    for (int a = 0; a < 3; ++a) x[a] = low[a] + part(random) * (high[a] - low[a]);
  }
  begin = Clock::now();
  const client::FieldValues values = field.at(points);
  const double at_us = 1e6 * seconds(begin) / kPoints;
  Points now(3, kPoints);
  Eigen::Index inside = 0;
  std::vector<Eigen::Index> of;
  for (Eigen::Index i = 0; i < kPoints; ++i) {
    if (values.where[static_cast<std::size_t>(i)] != client::Where::kInside) continue;
    now.col(inside++) = points.col(i) + values.displacement.col(i);
    of.push_back(i);
  }
  now.conservativeResize(3, inside);
  begin = Clock::now();
  const client::Undeformed was = field.undeformed(now);
  const double undeformed_us = 1e6 * seconds(begin) / static_cast<double>(inside);
  double error_mm = 0.0;
  Eigen::Index lost = 0;
  for (Eigen::Index i = 0; i < inside; ++i) {
    if (was.where[static_cast<std::size_t>(i)] == client::Where::kInside) {
      error_mm = std::max(error_mm,
                          (was.points.col(i) - points.col(of[static_cast<std::size_t>(i)])).norm());
    } else {
      ++lost;
    }
  }
  std::printf("nodes,mesh_ms,at_us,undeformed_us,greatest_error_mm,inside,not_found\n");
  std::printf("%d,%.1f,%.3f,%.3f,%.2g,%td,%td\n", static_cast<int>(nodes.cols()), build_ms, at_us,
              undeformed_us, error_mm, inside, lost);
  return 0;
}

}  // namespace
}  // namespace brainshift

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: bench_field model.h5\n", stderr);
    return 2;
  }
  return brainshift::run(argv[1]);
}
