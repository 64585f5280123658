// SPDX-License-Identifier: GPL-3.0-or-later
// Can the body still move as a rigid one? Answered from the directions that are held, not from a pivot.
#pragma once

#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::forward {

// The displacement of `place` along unit `direction` is held.
struct HeldDirection {
  Vec3 place;
  Vec3 direction;
};

// kFloatingBody, saying how many of the six rigid motions are free, unless the directions hold them all. Rotations are
// weighed by the size of the body (mm), so that the answer does not depend on the unit of length.
Status check_support(const std::vector<HeldDirection>& held, const Vec3& centre, double size_mm);

}  // namespace brainshift::forward
