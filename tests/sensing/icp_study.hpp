// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of the study of alignment.
#pragma once

namespace brainshift::sensing {

// 4,000 points against a surface of 5,120 triangles: time against a forward solve of the default head and against the
// Point Cloud Library, residuals against the exact surface.
void study_icp_speed();

// Random starts with outliers and partial coverage: how often the pose is found; and what a sphere shows.
void study_icp_convergence();
void study_icp_sphere();

}  // namespace brainshift::sensing
