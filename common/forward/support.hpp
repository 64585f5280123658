// SPDX-License-Identifier: GPL-3.0-or-later
// Check that a body cannot move rigidly. It looks at the directions that are held, not at a
// pivot.
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

// Ok when the directions hold all six rigid motions; otherwise kFloatingBody, with the number of
// motions that are free. Rotations are weighted by the size of the body (mm), so that the answer
// does not depend on the unit of length.
Status check_support(const std::vector<HeldDirection>& held, const Vec3& centre, double size_mm);

}  // namespace brainshift::forward
