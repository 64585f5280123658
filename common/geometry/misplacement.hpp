// SPDX-License-Identifier: GPL-3.0-or-later
// Which mistake of unit or frame explains points that do not lie where they should. One list for
// every input that is compared with a model.
#pragma once

#include <functional>
#include <string>

#include "common/core/types.hpp"

namespace brainshift::geometry {

// The end of a sentence about points that do not fit: "; in LPS instead of RAS?", "; in metres
// instead of millimetres?" and so on: the first after which the points spread over 3 to 500 mm
// and fits(points in mm RAS) holds; "" where there is none.
std::string likely_mistake(const Points& points, const std::function<bool(const Points&)>& fits);

// A single place of a head, as a user types it, that is likely in metres: within half a millimetre
// of the origin but not on it, and fits(1000 x). "", or the end of a sentence that begins with what
// was typed: "lies within 0.1 mm of the origin; in metres it would be (46.0, -47.0, 9.0) mm".
std::string metres_for_millimetres(const Vec3& x, const std::function<bool(const Vec3&)>& fits);

}  // namespace brainshift::geometry
