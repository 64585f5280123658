// SPDX-License-Identifier: GPL-3.0-or-later
// Displacements of the patients' brains as CalculiX found them (calculix_deck.hpp), kept beside the
// deck: nodes.csv, the nodes of the mesh, and patient-N.csv, their displacements; mm RAS.
#pragma once

#include <filesystem>

#include "client/tools/twin/truth.hpp"
#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::evidence {

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

// One displacement, whatever the load.
class GivenTruth final : public client::TruthSource {
 public:
  // Keeps a reference to the contact, by which slaves in the skull are counted.
  GivenTruth(Points displacement, const contact::PenaltyContact& contact);
  Result<client::Truth> solve(const Points& load) override;

 private:
  client::Truth truth_;
};

}  // namespace brainshift::evidence
