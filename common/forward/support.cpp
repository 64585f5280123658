// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/forward/support.hpp"

#include <fmt/format.h>

#include "common/core/small_matrices.hpp"

namespace brainshift::forward {
namespace {

// Squared sine-like measure of how well a rigid motion is held. Below it the motion counts as
// free.
constexpr double kHeld = 1e-10;

}  // namespace

Status check_support(const std::vector<HeldDirection>& held, const Vec3& centre, double size_mm) {
  Mat6 gram = Mat6::Zero();
  for (const HeldDirection& h : held) {
    Vec6 row;
    row << h.direction, ((h.place - centre) / size_mm).cross(h.direction);
    gram += row * row.transpose();
  }
  const Vec6 eigenvalues = symmetric_eigenvalues(gram);
  const double largest = std::max(eigenvalues[5], 1.0);
  const auto free = (eigenvalues.array() < kHeld * largest).count();
  if (free == 0) return {};
  return fail(ErrorCode::kFloatingBody,
              fmt::format("conditions: the body is not held: {} of its 6 rigid motions {} free",
                          free, free == 1 ? "is" : "are"));
}

}  // namespace brainshift::forward
