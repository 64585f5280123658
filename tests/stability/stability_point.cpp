// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/stability_point.hpp"

#include <algorithm>
#include <cmath>

namespace brainshift::stability {

std::string to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::kGreen: return "green";
    case Verdict::kYellow: return "yellow";
    case Verdict::kGrey: return "grey";
    case Verdict::kRed: return "red";
  }
  return "red";
}

Verdict judge(const Point& point) {
  if (point.reason.empty() && point.status != "solved") return Verdict::kRed;
  if (!point.answered) return Verdict::kGrey;
  if (point.warned) return Verdict::kYellow;
  if (point.must_warn) return Verdict::kRed;
  return point.difference <= point.bound ? Verdict::kGreen : Verdict::kRed;
}

void set_refused(const Error& error, Point& point) {
  point.answered = false;
  point.status = std::string(to_string(error.code));
  point.reason = error.message;
}

// The reason's first clause says why the method stopped; every further one is a warning.
void set_answered(const Estimate& estimate, Point& point) {
  point.answered = true;
  point.status = std::string(to_string(estimate.status));
  point.reason = estimate.reason;
  point.warned = estimate.status != EstimateStatus::kConverged ||
                 estimate.reason.find("; ") != std::string::npos;
  point.iterations = estimate.contact.iterations;
  point.min_volume_ratio = estimate.min_volume_ratio;
}

bool FaultSeeder::strikes() { return on_ && random_.uniform() < 0.2; }

void FaultSeeder::field(Points& displacement, Point& point) {
  if (!strikes()) return;
  point.seeded = true;
  const auto node =
      static_cast<Eigen::Index>(random_.index(static_cast<std::uint64_t>(displacement.cols())));
  displacement.col(node) += 1e-3 * displacement.cwiseAbs().maxCoeff() * random_.direction();
}

void FaultSeeder::estimate(Estimate& estimate, Point& point) {
  if (!strikes()) return;
  point.seeded = true;
  if (estimate.contact_force_n.size() > 0) {
    const auto slave = static_cast<Eigen::Index>(
        random_.index(static_cast<std::uint64_t>(estimate.contact_force_n.size())));
    estimate.contact_force_n[slave] += 0.1 * estimate.contact_force_n.cwiseAbs().maxCoeff();
    return;
  }
  // Above the accuracy of the reduced method, 0.01 mm.
  const auto node = static_cast<Eigen::Index>(
      random_.index(static_cast<std::uint64_t>(estimate.displacement.cols())));
  estimate.displacement.col(node) += 0.05 * random_.direction();
}

std::vector<double> thinned(const std::vector<double>& grid, bool coarse) {
  if (!coarse || grid.size() <= 3) return grid;
  return {grid.front(), grid[grid.size() / 2], grid.back()};
}

std::vector<double> decades(int from, int to) {
  std::vector<double> values;
  for (int e = from; e <= to; ++e) values.push_back(std::pow(10.0, e));
  return values;
}

}  // namespace brainshift::stability
