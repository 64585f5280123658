// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/gross_errors.hpp"

#include <variant>

namespace brainshift::test_support {
namespace {

void spoil(Points& points, double fraction, double most_mm, Random& random) {
  const auto count = static_cast<int>(fraction * static_cast<double>(points.cols()));
  for (const int i : random.choose(count, static_cast<int>(points.cols()))) {
    const double length = kMinGrossError_mm + (most_mm - kMinGrossError_mm) * random.uniform();
    points.col(i) += length * random.direction();
  }
}

}  // namespace

Observation with_gross_errors(Observation observation, double fraction, Random& random) {
  if (auto* boundary = std::get_if<TumourBoundary>(&observation.body)) {
    spoil(boundary->points, fraction, kMaxOfPoints_mm, random);
  } else if (auto* pairs = std::get_if<LandmarkPairs>(&observation.body)) {
    spoil(pairs->deformed, fraction, kMaxOfDisplacements_mm, random);
  }
  return observation;
}

}  // namespace brainshift::test_support
