// SPDX-License-Identifier: GPL-3.0-or-later
// InversionOptions: what a caller may ask of one inversion, whatever its method;
// OmissionErrors: what it may have lost by what a scene leaves out.
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// MovingData: data that depend on where the brain is, such as distances to a measured surface,
// whose closest points move with the estimate.
// The inversion measures the data anew for every estimate until they stay where they are.
struct MovingData {
  std::vector<NodeIndex> nodes;  // relocate() is given the displacement of these nodes
  // u: 3 x nodes, mm. Replaces `data` and returns true; returns false when the data have not moved
  // enough to matter.
  std::function<bool(const Points& u, SparseData& data)> relocate;
};

struct InversionOptions {
  // Called after every iteration with the iterate so far (status kIterating); may be empty. Method
  // condensed calls it once at most, in an update that has taken a tenth of a second and is not
  // near its end, with a provisional field and its standard deviation.
  std::function<void(const Estimate&)> on_iterate;
  // Data that follow the deformation. Method condensed takes them; the other methods reject data
  // along a direction and do not look at this. Null: no datum moves.
  const MovingData* moving = nullptr;
  // Checked once per iteration, by method condensed before every trial load. A requested stop
  // ends the inversion with the error of stopped().
  std::stop_token stop;
  // What the update has taken before the inversion, ms: of condensed.deadline_ms.
  double spent_ms = 0.0;
};

// The error of an inversion that ended because its caller asked for it: kNotConverged, "inversion
// was stopped at iteration K". iteration: the one that was not begun, from 1.
inline tl::unexpected<Error> stopped(int iteration) {
  return fail(ErrorCode::kNotConverged,
              "inversion was stopped at iteration " + std::to_string(iteration));
}

// OmissionErrors: what an update may have lost by the parts that its scene leaves out.
// Upper estimates of the greatest move of any node, mm; 0 for a part that was carried.
struct OmissionErrors {
  double contact_mm = 0.0, gravity_modes_mm = 0.0, far_field_mm = 0.0;
  // Least distance between a slave and the skull, mm; negative when a slave penetrates, infinite
  // without slaves.
  double nearest_slave_mm = 0.0;
};

}  // namespace brainshift::inversion
