// SPDX-License-Identifier: GPL-3.0-or-later
// What the brain of a surgery does under a load: its forward model, and TruthSolver, which solves
// K u = b with penalty contact for one load after the other.
//
// It solves the penalty equations as the paper does (section 2.4): solve for the active set, take
// the slaves that penetrate as the next set, until the set repeats. The linear solver is
// contact::WoodburySystem, which checks each of its solves, and every load starts from the set of
// the load before. So a load that changes little costs a few solves instead of a search from the
// empty set. A set that repeats is a solution of the penalty equations wherever the search began.
#pragma once

#include "client/tools/twin/truth_brain.hpp"
#include "common/contact/forward_model.hpp"
#include "common/contact/penalised_system.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"

namespace brainshift::client {

struct Truth {
  Points displacement;  // 3 x n, mm
  int active = 0;       // slaves that carry a contact force
  // Over all slaves. Negative: minus the least distance to the skull.
  double max_penetration_mm = 0.0;
  int iterations = 0;  // sets solved for
};

// What the brain does under a load.
class TruthSource {
 public:
  virtual ~TruthSource() = default;
  // load: 3 x nodes of the body, N.
  virtual Result<Truth> solve(const Points& load) = 0;
};

class TruthSolver final : public TruthSource {
 public:
  // Keeps a reference to `forward`, which must outlive it.
  explicit TruthSolver(const contact::ForwardModel& forward) : system_(forward) {}

  // load: 3 x n, N. kNotConverged: the set has not repeated after kMaxIterations solves.
  // Otherwise errors as contact::WoodburySystem.
  Result<Truth> solve(const Points& load) override;

  static constexpr int kMaxIterations = 40;

 private:
  contact::WoodburySystem system_;
};

// One displacement, whatever the load.
class GivenTruth final : public TruthSource {
 public:
  // Keeps a reference to the contact, by which slaves in the skull are counted.
  GivenTruth(Points displacement, const contact::PenaltyContact& contact);
  Result<Truth> solve(const Points& load) override;

 private:
  Truth truth_;
};

// The forward model of the brain with contact. On the case's own mesh and gap that of
// contact::ForwardModel::build. Otherwise
//   nodes     a middle of an edge between two boundary nodes is free where both ends are, fixed
//             along the normal where one end is, else a slave
//   slaves    the case's; of quadratic elements the middles alone. The penalty is spread so that
//             the skull is as stiff by area as the case's.
//   gap       with gap_seed 0.5 to 4 mm, uniform, along each slave's contact normal; it takes the
//             place of the case's
// Errors as contact::ForwardModel.
Result<contact::ForwardModel> truth_forward(const TruthBrain& brain, const Progress& progress = {});

}  // namespace brainshift::client
