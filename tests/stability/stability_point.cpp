// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/stability_point.hpp"

#include <cmath>

namespace brainshift::stability {

std::string to_string(Fault fault) {
  switch (fault) {
    case Fault::kNone: return "none";
    case Fault::kSign: return "sign";
    case Fault::kNormal: return "normal";
    case Fault::kScale: return "scale";
  }
  return "none";
}

void set_refused(const Error& error, Point& point) {
  point.answered = false;
  point.status = std::string(to_string(error.code));
  point.reason = error.message;
}

// The reason's first clause states why the method stopped; every further one is a warning.
void set_answered(const Estimate& estimate, Point& point) {
  point.answered = true;
  point.status = std::string(to_string(estimate.status));
  point.reason = estimate.reason;
  point.warned = estimate.status != EstimateStatus::kConverged ||
                 estimate.reason.find("; ") != std::string::npos;
  point.iterations = estimate.contact.iterations;
  point.min_volume_ratio = estimate.min_volume_ratio;
}

std::vector<double> thinned(const std::vector<double>& values, Grid grid) {
  if (grid == Grid::kMiddle) return {values[(values.size() - 1) / 2]};
  if (grid == Grid::kFull || values.size() <= 3) return values;
  return {values.front(), values[values.size() / 2], values.back()};
}

std::vector<double> decades(int from, int to) {
  std::vector<double> values;
  for (int e = from; e <= to; ++e) values.push_back(std::pow(10.0, e));
  return values;
}

}  // namespace brainshift::stability
