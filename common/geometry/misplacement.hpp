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

}  // namespace brainshift::geometry
