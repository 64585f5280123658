// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid registration of corresponding points (fiducials), and the error that remains at a target.
//
//   T = argmin sum_i |T p_i - q_i|^2, p_i measured, q_i in the image
//                                                  (Arun, Huang & Blostein 1987; Umeyama 1991)
//   FRE^2 = mean_i |T p_i - q_i|^2
//   <FRE^2> = (1 - 2/N) <FLE^2>                               (Sibson 1979)
//   <TRE^2>(x) = <FLE^2>/N (1 + 1/3 sum_k d_k^2 / f_k^2)      (Fitzpatrick, West & Maurer 1998)
// d_k: distance of the target x from principal axis k of the fiducials q_i.
// f_k: rms distance of the fiducials from that axis.
//
// Assumptions: fiducial localisation errors (FLE) are independent, zero-mean, isotropic and alike.
// Three fiducials leave three degrees of freedom to estimate FLE from, so that estimate is rough.
// FRE says nothing about the error at the target beyond FLE: a small FRE of few fiducials proves
// nothing.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::registration {

struct FiducialRegistration {
  RigidTransform T_image_measured = RigidTransform::Identity();
  VecX residuals_mm;    // |T p_i - q_i|
  double fre_mm = 0.0;  // rms of residuals_mm
  double fle_mm = 0.0;  // rms length of a fiducial's localisation error, estimated from FRE
  // measured fiducial i corresponds to image fiducial of_image[i]
  std::vector<int> of_image;
  Points image;  // 3 x n, in the order of the measured ones
};

// measured, image: 3 x n corresponding points, n >= 3, mm, each set in its own frame.
// kInvalidArgument: the numbers differ, fewer than 3, all on one line, two at one place (named),
// or extents that differ by more than a factor of 1.5 (the sentence guesses a mix-up of units).
// kNotFinite: names the set and the point.
Result<FiducialRegistration> register_fiducials(const Points& measured, const Points& image);

struct MatchOptions {
  // Distances between two fiducials may differ by this much between measurement and image. A
  // correspondence with a larger FRE is rejected.
  double tolerance_mm = 5.0;
  // The match is rejected as ambiguous when another correspondence fits nearly as well: its FRE is
  // less than this factor larger ...
  double ambiguity_factor = 2.0;
  // ... or larger by less than this (the localisation error of a pointer or of a marker's centre).
  double ambiguity_mm = 1.0;
};

// The same without a known order. Every assignment of the measured fiducials to as many of the
// image's (which may be more) that keeps all distances is tried. At most 10 measured and 16 in the
// image.
// The errors of register_fiducials; kNotConverged when none fits ("no correspondence ...");
// kInvalidArgument when two fit nearly alike (mirror-like or regular arrangements), with both
// residuals, and when the image's fiducials span no head.
Result<FiducialRegistration> match_fiducials(const Points& measured, const Points& image,
                                             const MatchOptions& options = {});

// What fiducials on a head span, and what a registration of a head leaves. A pointer on skin or on
// an anatomical landmark misses by 2 to 5 mm, so more than 5 mm rms is poor, and more than 10 mm
// comes from lists that do not belong together.
inline constexpr double kSmallestSpan_mm = 30.0, kLargestSpan_mm = 500.0;
inline constexpr double kPoorFre_mm = 5.0, kLargestFre_mm = 10.0;

// Whether a fit can be the registration of a head. measured: as it was fitted; names: of the
// fiducials, or empty.
// kInvalidArgument: the fiducials span less or more than above; the FRE is above kLargestFre_mm; or
// it is above 2 mm, and at least four fiducials fit four times as well as a mirror image, or with
// two of them exchanged; or names contradict places: right and left, nasion and inion (LPS for RAS
// is a rotation, which the FRE cannot tell). The sentence names the mistake that explains it: the
// unit, left and right, the two fiducials.
Status check_head_fit(const Points& measured, const FiducialRegistration& fit,
                      const std::vector<std::string>& names = {});

// How far the points are from lying on one line: their rms extent along the second principal axis
// over that along the first. 1: as wide as long; 0: on a line.
// Precondition: at least 2 points, not all at one place.
double thinness(const Points& points);

// Expected rms target registration error, mm, at `target` (image frame, mm), for image fiducials
// with the given localisation error. Precondition: at least 3 fiducials, not on one line.
double expected_tre_mm(const Points& image_fiducials, double fle_mm, const Vec3& target);

}  // namespace brainshift::registration
