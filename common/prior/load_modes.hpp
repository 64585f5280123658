// SPDX-License-Identifier: GPL-3.0-or-later
// Load modes of the prior: families of nodal force fields for what a surgery does to a brain, each
// column times the standard deviation that the case gives its family.
//
//   along, across gravity  for each fluid level of the case the buoyancy of a fluid plane at that
//                          level: along gravity (drainage is unknown), and along the two directions
//                          across it (pose is unknown)
//   gravity sides, ends    the same along gravity, times tanh(x / kMidlineWidth_mm) of the distance
//                          x from the brain's middle to the right, or to the front: fluid does not
//                          drain, nor air enter, everywhere alike. Where septa part the halves,
//                          what drains of one says little of the other: the sides then belong to
//                          drainage, kHalvesApart as strong and with its strength (decision 0045)
//   tumour volume          tissue that changes its volume by the strain theta near the tumour with
//                          centre c (fem/body_loads.hpp): oedema lies beside a tumour and differs
//                          from place to place. For each radius s of the case bumps
//                            theta = h exp(-|x - c_n|^2 / 2 s^2),  c_n = c + sqrt(2) s (i, j, k)
//                          with i, j, k in {-1, 0, 1} and c_n at most kTumourVolumeReach_mm from c.
//                          h is such that theta(c) of one radius has variance 1; the radii share
//                          the standard deviation of theta(c) equally
//   brain volume           the same strain in the whole brain, theta = 1; with opposite sign in the
//                          hemispheres, theta = tanh(x / kMidlineWidth_mm) of the distance x from
//                          the brain's middle to the right; and growing from back to front and from
//                          below, -1 to 1; and of the middle, where fluid is drained from the
//                          ventricles or dammed up in them: theta = exp(-|x - c|^2 / 2 s^2) about
//                          six places c of them, kVentriclesApart to either side of the brain's
//                          middle, kVentricleLength in front of it, beside it and behind, and
//                          kVentriclesAbove it; all in parts of the brain's extent along that axis,
//                          s = kVentricleWidth of that from back to front. Not where the model has
//                          ventricles
//   resection              w = exp(-r^2 / 2 s^2), whose integral over space is the tumour's volume
//                          (2 pi)^(3/2) s^3. A weight w rho g along each axis, rho g that of tissue
//                          in air; and an initial stress w sigma0, one of its six components at a
//                          time
//   opening                traction on the craniotomy's patch along each axis, in bumps: one in its
//                          middle and kBumpsOfRing around it, at kRing of its half axes, Gaussians
//                          with standard deviations of kBumpWidth of them. What pulls or presses
//                          there, a spatula or dura that gives way, does not do so all over
//   ventricles             pressure on the wall of the ventricles, pressing the tissue outwards:
//                          the same all over, and tanh(x / kMidlineWidth_mm) of the distance x from
//                          the brain's middle to the right: fluid is drained from one of the two
//   tract                  what instruments do on the straight way from the middle of the opening
//                          to the tumour's centre, of length l. At the depth t l and the distance r
//                          from the way
//                            w_k = max(0, 1 - |2 t - k|) exp(-r^2 / 2 s^2),  k = 0, 1, 2,
//                          s = kTractWidth_mm. An initial stress p w_k in each of the three
//                          components across the way, which parts tissue or lets it close; and a
//                          force density p w_k / s in both directions across, which moves it aside
// Swelling honours the stiffness of tumour and regions (contact::tissue_map). All families have
// zero mean and their columns are independent.
#pragma once

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::prior {

// Width of the step between the hemispheres.
inline constexpr double kMidlineWidth_mm = 10.0;
// Given what one half has lost, the other one's mean is (1 - k^2) / (1 + k^2) of it: a half.
inline constexpr double kHalvesApart = 0.58;
// Half of a brain's width: what swells with a tumour lies in its hemisphere.
inline constexpr double kTumourVolumeReach_mm = 75.0;

// Of the opening, in parts of its half axes.
inline constexpr int kBumpsOfRing = 6;
inline constexpr double kRing = 0.65, kBumpWidth = 0.45;

// Of the ventricles: of lateral ventricles 13 mm from the midline whose bodies and horns take up
// half of a brain's length.
inline constexpr double kVentricleWidth = 0.1, kVentriclesApart = 0.1, kVentricleLength = 0.15,
                        kVentriclesAbove = 0.05;
// Of the tract: half the width of a retractor's blade.
inline constexpr double kTractWidth_mm = 8.0;

struct LoadModes {
  Eigen::MatrixXd columns;    // 3n x k, N, node-major, in the order of the parts
  PerPart<int> of_part = {};  // how many columns belong to each part; 0 for the residual fields

  int size() const { return static_cast<int>(columns.cols()); }
};

// Errors of contact::tissue_map, which name the key. A craniotomy without a triangle between three
// of its nodes has neither opening nor tract modes.
Result<LoadModes> load_modes(const BrainModel& model, const CaseConfig& config);

// The part that column `column` belongs to when the parts have so many columns. Precondition: there
// is such a column.
PriorPart part_of_column(int column, const PerPart<int>& of_part);

}  // namespace brainshift::prior
