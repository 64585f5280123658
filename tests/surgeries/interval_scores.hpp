// SPDX-License-Identifier: GPL-3.0-or-later
// What error bars are worth: scores that are proper, i.e. on average least for the distribution
// that the errors really have. Too wide is as bad as too narrow.
//
// Source: Gneiting and Raftery 2007, J Am Stat Assoc 102:359, section 6.2 (interval) and
// equation 21 (CRPS). Errors are components, mm; the estimate is Gaussian with standard deviation
// sd about itself.
#pragma once

#include <array>
#include <vector>

#include "common/core/types.hpp"

namespace brainshift::surgeries {

inline constexpr double kNormalQuantile95 = 1.6448536269514722;  // half width of 90 %, in sd

// Central intervals of a Gaussian: the share that each holds, and its half width in standard
// deviations.
struct Interval {
  int percent;
  double radius;
};
inline constexpr std::array<Interval, 6> kIntervals = {
    {{50, 0.6745}, {68, 0.9945}, {80, 1.2816}, {90, 1.6449}, {95, 1.9600}, {99, 2.5758}}};

// Interval score of the central 90 % interval (Winkler): its width, and 2 / 0.1 times what lies
// beyond it:   2 q sd + 20 max(0, |error| - q sd)
double interval_score(double error, double sd);

// Continuous ranked probability score of a Gaussian, z = error / sd:
//   sd [ z (2 Phi(z) - 1) + 2 phi(z) - 1 / sqrt(pi) ];   |error| for sd = 0
double gaussian_crps(double error, double sd);

// Radius, in standard deviations of a component, of balls in three dimensions that hold all of
// `count` errors at once with 90 % probability at least, however they hang together (Bonferroni):
// each holds 1 - 0.1 / count. 2.5003 for one, 5.2 for twenty thousand.
double simultaneous_radius(long count);

// Of some nodes. NaN where there are none, and without sd for all that needs it.
struct RegionScore {
  int nodes = 0;
  double error_mm = 0.0, none_mm = 0.0;                 // mean |u - t| and |t|
  double coverage_90 = 0.0;                             // of components
  std::array<double, kIntervals.size()> coverage = {};  // the same for each of kIntervals
  double interval_mm = 0.0, crps_mm = 0.0;              // means over components
  double rms_sd_mm = 0.0, rms_error_mm = 0.0;           // of a component
};
// displacement, truth: 3 x n. sd: n, or none. nodes: indices.
RegionScore score_region(const Points& displacement, const Points& truth, const VecX& sd,
                         const std::vector<int>& nodes);

// Nodes, of `nodes`, within reach_mm of one of the places.
std::vector<int> nodes_near(const Points& mesh_nodes, const std::vector<int>& nodes,
                            const Points& places, double reach_mm);

}  // namespace brainshift::surgeries
