// SPDX-License-Identifier: GPL-3.0-or-later
// The tissue of each tetrahedron of a patient's brain, by the case's material section.
//
//   material.tumour    tetrahedra whose centre lies inside the tumour's surface
//   material.regions   tetrahedra of a label of the mesh (ventricles, white matter, tentorium)
//   the rest           material itself
// The tumour has precedence over the regions. Density, permeability and storage are the same
// everywhere.
#pragma once

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/fem/elasticity.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::contact {

// kInvalidArgument: a label that the mesh does not have; the sentence names the labels it has.
// kEmptySet: no tetrahedron has its centre in the tumour.
Result<fem::MaterialMap> tissue_map(const BrainModel& model, const Material& material);

}  // namespace brainshift::contact
