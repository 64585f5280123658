// SPDX-License-Identifier: GPL-3.0-or-later
// A slice of two volumes side by side, for looking at.
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "common/ultrasound/compound.hpp"

namespace brainshift::test_support {

// Index along the axis `axis` of the slice with the most voxels of positive weight.
int fullest_slice(const std::vector<float>& weight, const std::array<int, 3>& dims, int axis = 2);

// PNG: ours, theirs, |difference|, with a bar of 10 mm. Slice of constant index along `axis`.
void write_slice_pair(const std::filesystem::path& path, const std::vector<float>& ours,
                      const std::vector<float>& theirs, const ultrasound::VolumeGrid& grid,
                      int slice, int axis = 2);

}  // namespace brainshift::test_support
