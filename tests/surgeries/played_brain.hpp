// SPDX-License-Identifier: GPL-3.0-or-later
// A true brain and the factor of its stiffness, for the surgeries that share it. Stays where it was
// made: the solver refers to the factor.
#pragma once

#include <memory>
#include <utility>

#include "client/tools/twin/surgery.hpp"
#include "common/core/error.hpp"

namespace brainshift::surgeries {

struct PlayedBrain {
  client::TruthBrain brain;
  contact::ForwardModel forward;
  client::TruthSolver solver;

  PlayedBrain(client::TruthBrain of, contact::ForwardModel model)
      : brain(std::move(of)), forward(std::move(model)), solver(forward) {}
};

// Errors of truth_forward.
inline Result<std::unique_ptr<PlayedBrain>> factorised(client::TruthBrain brain) {
  auto forward = client::truth_forward(brain);
  if (!forward) return tl::unexpected(forward.error());
  return std::make_unique<PlayedBrain>(std::move(brain), std::move(*forward));
}

}  // namespace brainshift::surgeries
