// SPDX-License-Identifier: GPL-3.0-or-later
// Semi-automatic tracing: from a point in the lesion on one image to its contour there and on the
// images beside it.
//
// The smoothed image is sampled on rays from the seed: r(theta_j), j = 0 .. n-1. The contour is
// the closed path that maximises
//   sum_j e(theta_j, r_j) - stiffness |r_j - r_{j-1}|
// e: the mean inside minus the mean outside over edge_width_px along the ray (its negative for a
// lesion darker than its surroundings). Dynamic programming finds the path (Amini, Weymouth &
// Jain, "Using dynamic programming for solving variational problems in vision", PAMI 12 (1990)).
// The seed then moves to the contour's centroid, and the search is repeated once.
// The next image starts from the last contour: its centroid is the seed, and radii may differ by
// `radius_change` at most.
//
// The search always finds some edge. Two numbers that it does not optimise decide whether the edge
// bounds anything:
//   significance  difference between the mean of the whole inside and the mean of a ring outside,
//                 in the lesion's direction and in standard errors: the standard deviation over
//                 the square root of the number of smoothed speckles in each
//   confidence    fraction of rays on which inside and outside differ in the lesion's direction by
//                 at least half of that difference
// Below the limits the tracer reports an error and gives no contour.
//
// Limitation: this does not segment every lesion. The lesion must be roughly star-shaped seen from
// the seed, and brighter or darker than its surroundings.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/tracking/recording.hpp"
#include "common/ultrasound/boundary.hpp"

namespace brainshift::ultrasound {

enum class Echogenicity { kAuto, kBright, kDark };  // of the lesion against its surroundings

struct TracerOptions {
  Echogenicity echogenicity = Echogenicity::kAuto;
  double smoothing_px = 2.0;  // sd of the Gaussian; about a speckle
  int rays = 96;
  double min_radius_px = 6.0;  // smaller ones are speckle
  double max_radius_px = 150.0;
  double edge_width_px = 6.0;
  double stiffness = 0.3;       // of the image's sd, per pixel of radius from ray to ray
  double radius_change = 0.35;  // from image to image, of the radius
  // The best path through noise alone reaches 5.4 in 180 images of fine speckle
  // (lesion_tracer_test.cpp). Speckles much larger than smoothing_px are fewer than this counts,
  // so they need more smoothing.
  double min_significance = 8.0;
  double min_confidence = 0.7;
};

struct TracedContour {
  Contour contour;  // closed, one point per ray
  bool bright = true;
  double significance = 0.0;
  double confidence = 0.0;
};

struct Seed {
  int frame = 0;
  Eigen::Vector2d at_px = Eigen::Vector2d::Zero();
};

// One image. kInvalidArgument: a seed outside the image, a frame that does not exist or has no
// valid image, an option out of range (named). kEmptySet: no boundary found (the sentence gives
// significance and confidence). Errors name the frame.
Result<TracedContour> trace_lesion(const tracking::Recording& recording, const Seed& seed,
                                   const TracerOptions& options = {});

struct LesionSweep {
  std::vector<TracedContour> contours;  // by frame, ascending
  // Why no contour precedes the first; empty: the recording begins there.
  std::string stopped_before;
  // Why no contour follows the last; empty: the recording ends there.
  std::string stopped_after;
};

// The seed's image and, in both directions, every valid image up to the first without a boundary.
// Errors of trace_lesion, for the seed's image.
Result<LesionSweep> trace_sweep(const tracking::Recording& recording, const Seed& seed,
                                const TracerOptions& options = {});

}  // namespace brainshift::ultrasound
