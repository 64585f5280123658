// SPDX-License-Identifier: GPL-3.0-or-later
// Closed planar contours in space to the voxels of a grid, by their places alone.
//
// The contours lie in parallel planes n . x = d_p. A place belongs to the nearest plane; it is
// inside where it lies within an odd number of that plane's contours (a contour within another is a
// hole) or, to kOnContour_mm, on one. A plane reaches half way to each neighbour. At the ends, and
// where the neighbour is farther than kGap spacings, it reaches half a spacing; the spacing is the
// median of the distances between neighbours, and of a single plane the grid's step along n.
// So planes need not lie on the grid's slices, nor be parallel to them.
//
// Precondition of all: finite places, RAS, mm; contours closed, the last point not repeated.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

// How far a contour's points may lie out of its plane, and planes of one place from each other.
inline constexpr double kOutOfPlane_mm = 0.1;
inline constexpr double kOnContour_mm = 0.01;
inline constexpr double kGap = 1.5;

struct FilledContours {
  VoxelImage mask;  // 1 inside, else 0
  int planes = 0;
  double spacing_mm = 0.0;
  // What a person should know: gaps, planes turned or shifted against the grid's slices.
  std::vector<std::string> notes;
};

// kInvalidArgument, one line that names the contour by its number from 1: none with an area, points
// out of the plane, planes that are not parallel, contours of a plane that cross or that are there
// twice, points outside of the grid; no voxel whose centre is inside.
Result<FilledContours> fill_contours(const std::vector<Points>& contours, const VoxelImage& grid);

// Area of the planes' insides times how far each reaches, mm^3, whatever of it the grid holds.
// Errors as above.
Result<double> contours_volume_mm3(const std::vector<Points>& contours, const VoxelImage& grid);

}  // namespace brainshift::io
