// SPDX-License-Identifier: GPL-3.0-or-later
// The files that the CalculiX deck of a twin includes (calculix/patient.inp): another code's model
// of the same brain, with large displacements and with its own unilateral contact.
//
// CalculiX gets mesh, moduli, fixed nodes, weight and buoyancy as forces, how much tissue swells,
// and for each slave the gap, the normal and the penalty of the forward model's contact, as a
// GAPUNI element. Elements, strains, equilibrium and the search for contact are its own. Tissue
// with the volume strain theta is stretched by (1 + theta)^(1/3) before it is stressed. It is
// neo-Hookean,
//
//   U = C10 (I1 - 3) + (J - 1)^2 / D1,   C10 = G / 2,   D1 = 2 / K
//
// which for small strains is the case's material. Tried first, with a linear elastic material: at
// 0.87 of patient 1's load a fold of the cortex collapses, with gap elements and with CalculiX's
// contact between surfaces, which took ten times the iterations until there.
#pragma once

#include <filesystem>

#include "client/tools/twin/truth_brain.hpp"
#include "common/contact/penalty.hpp"
#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::evidence {

enum class Tissue {
  kNeoHookean,
  kLinear,  // the case's material itself, for a deck without NLGEOM
};

struct DeckLoad {
  Points forces;       // 3 x nodes, N
  VecX volume_strain;  // of each node, > -1
};

// mesh.inp, tissue.inp, held.inp, contact.inp, load.inp and swelling.inp in `folder`, which must
// exist. contact: of the brain's forward model. kInvalidArgument: the brain is solved for on
// another mesh. kWriteFailed names the file. Errors of tissue_map.
Status write_deck(const client::TruthBrain& brain, const contact::PenaltyContact& contact,
                  const DeckLoad& load, const std::filesystem::path& folder,
                  Tissue tissue = Tissue::kNeoHookean);

// Displacements that CalculiX printed (*NODE PRINT, U): the last block of the .dat file. 3 x nodes,
// mm. kNotFound: no such file, or it has no displacements; kInvalidArgument names the line that is
// none, and says how many nodes are missing.
Result<Points> read_printed_displacements(const std::filesystem::path& dat, int nodes);

// Displacements of the patients' brains as CalculiX found them, kept beside the
// deck: nodes.csv, the nodes of the mesh, and patient-N.csv, their displacements; mm RAS.
// Nodes farther apart than this are those of another mesh.
inline constexpr double kSameNode_mm = 0.001;

// Three columns, rounded to 1e-5 mm. kWriteFailed names the file.
Status write_points(const Points& points, const std::filesystem::path& file);
// kNotFound: no such file. kInvalidArgument names the line that is not three numbers.
Result<Points> read_points(const std::filesystem::path& file);

// The displacement of this patient's brain. nodes: of the mesh that it is wanted for. Errors of
// read_points; kInvalidArgument: the fields belong to another mesh.
Result<Points> read_calculix_truth(const std::filesystem::path& folder, int patient,
                                   const Points& nodes);

}  // namespace brainshift::evidence
