// SPDX-License-Identifier: GPL-3.0-or-later
// Displacement fields to NRRD files (.nrrd): float32, gzip, LPS.
//
// Kinds `vector domain domain domain`; space left-posterior-superior; places and vectors LPS, mm.
// Keys: `intent_code:=1006` and `displacement field type:=resampling|modeling`, by which 3D Slicer
// knows a displacement field and its direction (`modeling` since Slicer 5.10: earlier ones, and
// plastimatch and elastix, take every field for resampling); `brainshift note`.
// Source: teem's definition of NRRD (NRRD0005); Slicer, vtkITKTransformConverter and its NRRD
// reader.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "common/io/fields/displacement_field.hpp"

namespace brainshift::io {

// Errors of validate(), with the path in front; kUnreadable for another extension; kWriteFailed.
// The file appears whole or not at all.
Status write_nrrd(const std::filesystem::path& path, const DisplacementField& field);

}  // namespace brainshift::io
