// SPDX-License-Identifier: GPL-3.0-or-later
// InversionOptions: what a caller may ask of one inversion, whatever its method.
#pragma once

#include <functional>
#include <stop_token>

#include "common/core/error.hpp"
#include "common/inversion/contract/moving_data.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::inversion {

struct InversionOptions {
  // Called after every iteration with the iterate so far (status kIterating); may be empty. Method
  // condensed has no field before the last iteration and does not call it.
  std::function<void(const Estimate&)> on_iterate;
  // Data that follow the deformation. Method condensed takes them; the other methods reject data
  // along a direction and do not look at this. Null: no datum moves.
  const MovingData* moving = nullptr;
  // Checked once per iteration, by method condensed before every trial load. A requested stop
  // ends the inversion with the error of stopped().
  std::stop_token stop;
};

// The error of an inversion that ended because its caller asked for it: kNotConverged, "inversion
// was stopped at iteration K". iteration: the one that was not begun, from 1.
tl::unexpected<Error> stopped(int iteration);

}  // namespace brainshift::inversion
