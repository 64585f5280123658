// SPDX-License-Identifier: GPL-3.0-or-later
// NIfTI images: plain, compressed, and as a header with a second file.
#include <algorithm>

#include "common/io/geometry/image_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {
namespace {

void read(const std::filesystem::path& path) {
  const auto image = io::read_nifti(path);
  if (!image) return;
  require(image->values.size() == image->num_voxels(), "an image has a value for every voxel");
  require(image->T_ras_voxel.matrix().allFinite(), "an image lies somewhere");
}

}  // namespace

void run(std::string_view bytes) {
  read(scratch_file("image.nii", bytes));
  read(scratch_file("image.nii.gz", bytes));
  constexpr std::size_t kHeader = 348;
  scratch_file("pair.img", bytes.substr(std::min(kHeader, bytes.size())));
  read(scratch_file("pair.hdr", bytes.substr(0, kHeader)));
}

}  // namespace brainshift::fuzz
