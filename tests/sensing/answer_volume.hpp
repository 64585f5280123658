// SPDX-License-Identifier: GPL-3.0-or-later
// A volume that PLUS compounded, for comparison with ours.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "tests/support/compound.hpp"

namespace brainshift::test_support {

// MetaImage of unsigned char whose Offset and ElementSpacing are in the Reference frame, mm.
struct AnswerVolume {
  VolumeGrid grid;
  std::vector<float> values;
};
Result<AnswerVolume> read_answer(const std::filesystem::path& path);

// PLUS's volume holds no weights: empty voxels are 0, as are black ones.
enum class Voxels {
  kWeFilled,    // our weight is positive
  kPlusFilled,  // PLUS's value is positive; ours is 0 where we have no pixel
};

// Agreement over some voxels, our volume moved against PLUS's by whole voxels.
struct Agreement {
  double correlation = 0.0;
  double mean_difference = 0.0;  // absolute, grey values, where PLUS's is not 0
  long voxels = 0;
};

Agreement compare(const CompoundedVolume& ours, const AnswerVolume& answer,
                  const std::array<int, 3>& shift = {0, 0, 0}, Voxels voxels = Voxels::kWeFilled);

}  // namespace brainshift::test_support
