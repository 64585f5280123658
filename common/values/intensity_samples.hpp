// SPDX-License-Identifier: Apache-2.0
// IntensitySamples: an image as a set of points with one intensity each, for example the pixels
// of tracked ultrasound frames.
#pragma once

#include "common/core/types.hpp"

namespace brainshift {

struct IntensitySamples {
  Points positions;  // 3 x n, mm
  VecX intensities;  // n, any unit
};

}  // namespace brainshift
