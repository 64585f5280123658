// SPDX-License-Identifier: GPL-3.0-or-later
// SparseData -> Estimate: one entry for every inversion method.
#pragma once

#include <functional>
#include <stop_token>

#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"
#include "common/inversion/contract/moving_data.hpp"
#include "common/inversion/prepared/prepared_model.hpp"

namespace brainshift::inversion {

// A slave counts as penetrating when it is deeper than this: a hundredth of the 1 mm gap. Penalty contact
// leaves force / beta, some micrometres, at every slave that carries a force.
inline constexpr double kPenetrationTolerance_mm = 0.01;

struct InversionOptions {
  Method method = Method::kPaper;
  // Called after every iteration with the iterate so far (status kIterating); may be empty. The condensed methods
  // have no field before the last iteration and do not call it.
  std::function<void(const Estimate&)> on_iterate;
  // Data that follow the deformation (method condensed); null: none do.
  const MovingData* moving = nullptr;
  // Checked once per iteration; a requested stop ends the inversion with kNotConverged.
  std::stop_token stop;
};

// kInvalidArgument: fewer than 3 data, sizes that differ, sd <= 0, collinear positions, data outside the
// brain by more than 5 mm (the sentence names the datum); kNotFinite: NaN or infinity in the data.
Result<Estimate> invert(const PreparedModel& model, const SparseData& data,
                        const InversionOptions& options = {});

}  // namespace brainshift::inversion
