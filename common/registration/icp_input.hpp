// SPDX-License-Identifier: GPL-3.0-or-later
// What align() refuses. For the .cpp files of this folder only.
#pragma once

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/registration/icp.hpp"

namespace brainshift::registration {

// The errors of align() (icp.hpp).
Status check_alignment(const Points& points, const RigidTransform& T_surface_points_initial,
                       const IcpOptions& options);

}  // namespace brainshift::registration
