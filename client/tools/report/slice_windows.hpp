// SPDX-License-Identifier: GPL-3.0-or-later
// Which part of a head the slices of the report show. mm RAS. Private to client/report.
#pragma once

#include "client/tools/pictures/slice_panel.hpp"

namespace brainshift::client {

// The slice through `through` that holds all nodes (3 x n) with a margin of 10 mm, 5 px per mm.
SliceWindow whole_head(const Points& nodes, const Vec3& through, Plane plane);

// A square about `centre`, 2 half_mm wide, in the slice through it.
SliceWindow close_up(const Vec3& centre, double half_mm, double px_per_mm, Plane plane);

}  // namespace brainshift::client
