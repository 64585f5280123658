// SPDX-License-Identifier: GPL-3.0-or-later
// Truths from outside: what surgeries do to a brain and the prior's loads do not say. Nothing here
// uses common/prior. Each kind is a function that draws loads and changes; forward() of
// outside_truth.hpp solves for them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/random.hpp"
#include "tests/surgeries/outside/outside_head.hpp"

namespace brainshift::outside {

// What happens in one surgery.
struct Event {
  // Nodal forces, 3 x nodes of the space, N; of the moved body where `steps` > 1. Their size does
  // not count: they are multiplied by what gives `largest_mm` or `volume_loss`.
  std::function<Points(const fem::DisplacementSpace&)> load;
  double largest_mm = 0.0;  // the largest motion of a node of tissue
  // Instead: this part of a volume is lost, unless a node moves farther than largest_mm.
  double volume_loss = 0.0;
  // What part is, under nodal displacements u, 3 x nodes of the space. Empty: of no volume.
  std::function<double(const fem::DisplacementSpace&, const Points& u)> lost;
  Changes changes;
  Region no_wall;                           // where the skull is gone; empty: nowhere else
  std::optional<double> resected_fraction;  // of the tumour; changes.cavity says which elements
  int steps = 1;  // > 1: the geometry follows the load (updated Lagrangian)
};

struct Kind {
  std::string name, description;
  Event (*draw)(const OutsideHead& head, Random& random);
};
const std::vector<Kind>& all_kinds();
const Kind* find_kind(const std::string& name);  // nullptr when unknown
// Air above both halves: what the prior holds. Not one of all_kinds(); studies hold others against
// it.
const Kind& plain_sag();

// Loads, 3 x nodes of the space, N.
//
// Tissue that air surrounds has its weight, 1000 kg/m^3, along `down` where `in` holds.
Points weight_load(const fem::DisplacementSpace& space, const Vec3& down, const Region& in);
// f_i = int p grad N_i dV, p in N/mm^2 at places: pressure p of the tissue pushes outwards.
Points pressure_load(const fem::DisplacementSpace& space,
                     const std::function<double(const Vec3&)>& pressure);
// The part of the region's volume that is lost: - int_region div u / volume. 0 where it has none.
double volume_loss(const fem::DisplacementSpace& space, const Points& u, const Region& region);

}  // namespace brainshift::outside
