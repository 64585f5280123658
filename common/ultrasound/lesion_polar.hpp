// SPDX-License-Identifier: GPL-3.0-or-later
// An image seen along rays from a point, and the best closed path through it (lesion_tracer.hpp).
// Amini, Weymouth & Jain 1990.
#pragma once

#include <vector>

#include "common/core/types.hpp"
#include "common/tracking/recording.hpp"

namespace brainshift::ultrasound {

// rays x radii: one sample per pixel along each ray, the column is the radius in pixels. NaN
// outside of the image.
using PolarImage = Eigen::MatrixXf;

// Gaussian smoothing (standard deviation in pixels) of one frame; height x width.
Eigen::MatrixXf smoothed_frame(const tracking::Recording& recording, int frame, double sd_px);

// Bilinear interpolation. Rays turn from u towards v.
PolarImage polar_image(const Eigen::MatrixXf& image, const Eigen::Vector2d& centre_px, int rays,
                       int radii);

// Mean inside minus mean outside over `width` samples to either side of each sample. 0 where a
// sample is missing.
Eigen::MatrixXf edge_strength(const PolarImage& polar, int width);

// Allowed radii of a ray, samples, both ends included.
struct RadiusRange {
  int first = 0, last = 0;
};

// Radius index per ray of the closed path with the greatest sum of gain - stiffness |step|. Two
// passes close the path: an open path decides the radius of the ray opposite to its start, and a
// second path starts and ends there.
std::vector<int> best_closed_path(const Eigen::MatrixXf& gain,
                                  const std::vector<RadiusRange>& range, double stiffness);

}  // namespace brainshift::ultrasound
