// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of the study of alignment.
#pragma once

namespace brainshift::sensing {

// 4,000 points against a surface of 5,120 triangles: time beside a forward solve of the default
// head and beside the Point Cloud Library, residuals to the exact surface.
void study_icp_speed();

// Random starts with outliers and partial coverage: how often the pose is found.
void study_icp_convergence();
// A sphere: no rotation may be reported as shown.
void study_icp_sphere();

}  // namespace brainshift::sensing
