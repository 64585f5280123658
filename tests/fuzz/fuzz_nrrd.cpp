// SPDX-License-Identifier: GPL-3.0-or-later
// NRRD label maps and segmentations.
#include "common/io/geometry/label_map_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {

void run(std::string_view bytes) {
  const auto path = scratch_file("map.seg.nrrd", bytes);
  for (const char* segment : {"", "Mass"}) {
    const auto image = io::read_label_map(path, {segment, 1});
    if (!image) continue;
    require(image->values.size() == image->num_voxels(), "a label map has a label for every voxel");
    require(image->T_ras_voxel.matrix().allFinite(), "a label map lies somewhere");
  }
}

}  // namespace brainshift::fuzz
