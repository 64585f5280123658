// SPDX-License-Identifier: GPL-3.0-or-later
// Sparse data from an alignment (paper 2.7), with the errors that all its points share; and the
// errors of points that are used as they were measured (pose_errors).
//
//   x_i = T p_i         undeformed place of boundary point i, by the alignment
//   d_i = p_i - x_i     its displacement: deformed place minus undeformed place, mm
//
// The aligned points are not independent: the pose may be wrong, and a rigid alignment absorbs a
// part of the strain. Both are columns of SparseData::common_error.
#pragma once

#include "common/core/types.hpp"
#include "common/registration/icp.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::registration {

// Standard deviation of the strain that a rigid alignment of a deformed boundary absorbs, no unit.
// Brain shifts by millimetres over some 100 mm, which is a few per cent.
inline constexpr double kAlignmentStrainSd = 0.1;

// points: 3 x m, deformed, mm RAS. sd_mm: of each point, per component.
// common_error holds, by column and about the points' centroid:
//   - up to six axes of pose_covariance. With rotation_sd_deg > 0, rotations have that standard
//     deviation instead: a deformed, smooth boundary shows less of its rotation than the
//     covariance of independent points says;
//   - six strains of kAlignmentStrainSd.
SparseData sparse_data_from_alignment(const Points& points, const IcpResult& icp, double sd_mm,
                                      double rotation_sd_deg = IcpOptions{}.rotation_sd_deg);

// What all points of one measurement are off by together when the pose they were measured with is
// wrong:
//
//   e_i = sum_a c_a s unit_a + sum_a c_(3+a) t unit_a x (x_i - centroid),   c ~ N(0, I)
// with s = sd_mm and t = sd_deg in radians. Turns are linear: 1 degree moves a point 50 mm from the
// centroid by 0.87 mm, and this form is off by 0.008 mm.
// places: x_i, 3 x m, mm. -> 3m x q, mm: three shifts when sd_mm > 0, then three turns when
// sd_deg > 0; empty without either or without points.
Eigen::MatrixXd pose_errors(const Points& places, double sd_mm, double sd_deg);

}  // namespace brainshift::registration
