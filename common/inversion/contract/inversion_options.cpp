// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/contract/inversion_options.hpp"

#include <string>

namespace brainshift::inversion {

tl::unexpected<Error> stopped(int iteration) {
  return fail(ErrorCode::kNotConverged,
              "inversion was stopped at iteration " + std::to_string(iteration));
}

}  // namespace brainshift::inversion
