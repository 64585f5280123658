// SPDX-License-Identifier: GPL-3.0-or-later
// Brains drawn from the force prior of method condensed:
//
//   u = U z + G f(z),   z_j ~ N(0, a_g^2)
//
// a_g: strength of the part that column j belongs to; 1 as in the case. f: contact forces
// (inversion/skull/contact_at_loads.hpp). And what u is at three places. A part alone has the
// same z in its own columns and 0 elsewhere.
// What the modes leave out of the residual fields is not drawn; left_out_sd_mm says how much.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "tests/benchmarks/bench_head.hpp"

namespace brainshift::prior_study {

// Centre of the craniotomy; the tumour's centroid; cortex opposite the craniotomy.
inline constexpr int kPlaces = 3;
inline constexpr std::array<const char*, kPlaces> kPlaceNames = {"cortex", "tumour", "far side"};

// A point of the mesh.
struct MeshPoint {
  Eigen::Vector4i nodes = Eigen::Vector4i::Zero();
  Eigen::Vector4d weights = Eigen::Vector4d(1, 0, 0, 0);
  Vec3 at(const Points& nodal) const;
};

// In the order of kPlaceNames. cortex: the craniotomy's node that is closest to their mean. far
// side: the boundary node closest to the mirror image of that mean in the sagittal plane through
// the middle of the brain's extent.
std::array<MeshPoint, kPlaces> places_of(const BrainModel& model,
                                         const geometry::TetLocator& locator);

// Unit vector out of the craniotomy: the mean of its triangles' area vectors.
Vec3 outward_of(const BrainModel& model);

// z with every column times its part's strength.
VecX scaled_modes(const CondensedOperators& operators, const PriorScaleValues& strengths,
                  const VecX& z);

// "opening=1.5" for each part that is not as in the case. kInvalidArgument names a text whose part
// is unknown or comes twice, or whose number is not finite and at least 0.
Result<PriorScaleValues> parse_strengths(const std::vector<std::string>& texts);

// Root mean square of the three components' standard deviations, mm, at each place: what the modes
// leave out of the residual fields together.
std::array<double, kPlaces> left_out_sd_mm(const CondensedOperators& operators,
                                           const std::array<MeshPoint, kPlaces>& places);

struct PartDraws {
  std::string part;                                    // "total" or that of to_string(PriorPart)
  std::array<std::vector<double>, kPlaces> motion_mm;  // |u| of every draw
  std::vector<double> outward_mm;                      // u . outward at the cortex
  std::vector<double> min_volume_ratio;                // smallest det F; of "total" only
  int unsettled = 0;                                   // draws without a contact set: left out
};

// "total" first, then each part that has columns. At least one draw; the same seed gives the same
// brains. Errors of ContactAtLoads but for sets that do not settle.
Result<std::vector<PartDraws>> draw_prior(const bench::Head& head, int draws, std::uint64_t seed,
                                          const PriorScaleValues& strengths = kAsInTheCase);

}  // namespace brainshift::prior_study
