// SPDX-License-Identifier: GPL-3.0-or-later
// The header of a NIfTI file, checked before libnifti sees the file.
//
// libnifti prints complaints of its own to stderr, takes an impossible place of the voxels for
// another one, and trusts the sizes of what lies before it. With a file that passes it does none of
// that.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"

namespace brainshift::io {

// Ok for a NIfTI-1 or -2 header (.nii, .nii.gz, .hdr) of one 3-D volume of integer or real voxels:
// 1 to 32767 voxels along each axis, one entry along every other, and vox_offset a whole number
// behind the header (0 in a single file: right behind it) and inside the file. kUnreadable, "PATH:
// reason". Precondition: `path` is a regular file.
Status check_nifti_header(const std::filesystem::path& path);

// Bytes that a regular file can hold at most once unpacked: its size, or for a .gz file what
// deflate can make of it.
double largest_content(const std::filesystem::path& path);

}  // namespace brainshift::io
