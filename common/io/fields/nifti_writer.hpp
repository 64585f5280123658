// SPDX-License-Identifier: GPL-3.0-or-later
// Displacement fields and scalar volumes to NIfTI-1 files (.nii, .nii.gz).
//
// Fields are five-dimensional, x y z 1 3: the components are the slowest axis. Places are RAS, as
// in every NIfTI file. Programs disagree about the axes of the vectors, and the intent tells which:
//
//   intent 1006 DISPVECT   RAS vectors   3D Slicer, newer ITK. ITK 5.2.1 misreads it.
//   intent 1007 VECTOR     LPS vectors   ITK, ANTs, plastimatch
//
// Source: nifti1.h; what each program makes of it was tried (cmake/scripts/interchange.sh). The
// affine stands in sform and qform, both with code 1 (scanner). The qform is exact to single
// precision, because the axes are at right angles (voxel_grid.hpp).
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "common/io/fields/displacement_field.hpp"

namespace brainshift::io {

// Float32. kRas gives intent 1006, kLps 1007; intent_name is the direction, descrip direction,
// frame and note. Errors of validate(), with the path in front; kUnreadable for another extension;
// kWriteFailed. The file appears whole or not at all.
Status write_nifti(const std::filesystem::path& path, const DisplacementField& field,
                   VectorFrame vectors);
// Three-dimensional, float32; descrip is the note.
Status write_nifti(const std::filesystem::path& path, const ScalarVolume& volume);

}  // namespace brainshift::io
