// SPDX-License-Identifier: GPL-3.0-or-later
// A volume that PLUS compounded, as the answer to compare with.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "common/ultrasound/compound.hpp"

namespace brainshift::test_support {

// MetaImage of unsigned char whose Offset and ElementSpacing are in the Reference frame, mm.
struct AnswerVolume {
  ultrasound::VolumeGrid grid;
  std::vector<float> values;
};
Result<AnswerVolume> read_answer(const std::filesystem::path& path);

// Agreement over the voxels that we filled, our volume moved by whole voxels against PLUS's, which marks empty voxels with 0
// (as black ones) and holds no weights.
struct Agreement {
  double correlation = 0.0;
  double mean_difference = 0.0;  // absolute, grey values, where PLUS's is not 0
  long voxels = 0;
};

Agreement compare(const ultrasound::CompoundedVolume& ours, const AnswerVolume& answer,
                  const std::array<int, 3>& shift = {0, 0, 0});

}  // namespace brainshift::test_support
