// SPDX-License-Identifier: GPL-3.0-or-later
// NIfTI images to VoxelImage.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

// How far the steps that two entries of a header give may differ, relative; of NRRD too.
inline constexpr double kLargestStepError = 0.01;

// Reads a 3-D NIfTI-1/2 image (.nii, .nii.gz, .hdr/.img). Honours the sform, else the qform
// (oblique and left-handed ones too), scl_slope / scl_inter, every integer and float type. A 4-D
// image with one time point is accepted. Fails with kNotFound, or kUnreadable naming the file and
// what is wrong (no 3-D image, no usable affine, unsupported type, truncated, non-finite affine
// or spatial unit that is not mm, gzip under another name). So does a header that contradicts
// itself: steps of the sform that differ from pixdim by more than kLargestStepError, or an sform
// and a qform, both of the scanner's space, whose places of a voxel differ by more than half a
// voxel.
Result<VoxelImage> read_nifti(const std::filesystem::path& path);

}  // namespace brainshift::io
