// SPDX-License-Identifier: GPL-3.0-or-later
// CaseInputs -> BrainModel: mesh, surfaces and the node sets of the paper's section 2.6.
#pragma once

#include <string>
#include <vector>

#include "common/configuration/case_inputs.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::anatomy {

// Deterministic. An error is one sentence that names key and value.
//   kEmptySet         mask without component, a craniotomy that selects no node, no slave, no
//                     tumour voxel
//   kInvalidArgument  tumour outside the brain by more than kLargestCut_mm (tumour_surface.hpp);
//                     metres and millimetres mixed up in a given mesh (by its extent)
//   kDegenerateMesh   as make_brain_mesh
// notes (optional) receives what was made of the inputs that the user should know, a sentence each.
Result<BrainModel> build_brain_model(const CaseInputs& inputs, const Progress& progress = {},
                                     std::vector<std::string>* notes = nullptr);

}  // namespace brainshift::anatomy
