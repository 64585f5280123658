// SPDX-License-Identifier: GPL-3.0-or-later
// What data and prior claim: standard deviation over nine decades, correlation length from a
// fraction of an element to several heads, the same datum many times, two data that exclude each
// other.
#include "tests/stability/toy_problem.hpp"

namespace brainshift::stability {
namespace {

constexpr Method kMethods[] = {Method::kCondensed, Method::kPaper};

void standard_deviation(const Options& options) {
  auto problem = ToyProblem::make(stability_config(), options.fault);
  for (const double sd_mm : thinned(decades(-6, 3), options.grid)) {
    for (const double noise_mm : {0.0, 0.1}) {
      const auto data = sagging_data(*problem, {.noise_mm = noise_mm, .sd_mm = sd_mm});
      for (const Method method : kMethods) {
        Point point = point_at("data", "standard deviation of the data (mm)", sd_mm);
        point.row =
            std::string(to_string(method)) + (noise_mm > 0.0 ? ", noise of 0.1 mm" : ", no noise");
        invert_and_record(*problem, *data, method, point, options);
      }
    }
  }
}

void correlation_length(const Options& options) {
  const std::vector<double> grid = {0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 200.0};
  for (const double length_mm : thinned(grid, options.grid)) {
    CaseConfig config = stability_config();
    config.prior.correlation_length_mm = length_mm;
    auto problem = ToyProblem::make(config, options.fault);
    Point point = point_at("data", "correlation length of the prior (mm)", length_mm);
    if (!problem) {
      options.record_refused(problem.error(), point);
      continue;
    }
    const auto data = sagging_data(*problem, {});
    for (const Method method : kMethods) invert_and_record(*problem, *data, method, point, options);
  }
}

// The first datum again and again.
void duplicates(const Options& options) {
  auto problem = ToyProblem::make(stability_config(), options.fault);
  const auto once = sagging_data(*problem, {});
  const Eigen::Index m = once->size();
  for (const double copies : thinned({1.0, 3.0, 10.0, 30.0, 100.0, 200.0}, options.grid)) {
    const Eigen::Index more = static_cast<Eigen::Index>(copies) - 1;
    SparseData data{Points(3, m + more), Points(3, m + more), VecX::Constant(m + more, 0.2)};
    data.positions << once->positions, once->positions.col(0).replicate(1, more);
    data.displacements << once->displacements, once->displacements.col(0).replicate(1, more);
    for (const Method method : kMethods) {
      Point point = point_at("data", "copies of one datum", copies);
      invert_and_record(*problem, data, method, point, options);
    }
  }
}

void contradictions(const Options& options) {
  auto problem = ToyProblem::make(stability_config(), options.fault);
  const auto once = sagging_data(*problem, {});
  const std::vector<double> grid = {0.01, 0.1, 1.0, 3.0, 10.0, 14.0, 30.0, 100.0};
  for (const double apart_mm : thinned(grid, options.grid)) {
    SparseData data = *once;
    data.positions.col(1) = data.positions.col(0);
    data.displacements.col(1) = data.displacements.col(0) + Vec3(0.0, apart_mm, 0.0);
    for (const Method method : kMethods) {
      Point point = point_at("data", "contradiction of two data at one place (mm)", apart_mm);
      invert_and_record(*problem, data, method, point, options);
    }
  }
}

}  // namespace

void sweep_data(const Options& options) {
  standard_deviation(options);
  correlation_length(options);
  duplicates(options);
  contradictions(options);
}

}  // namespace brainshift::stability
