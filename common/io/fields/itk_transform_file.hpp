// SPDX-License-Identifier: GPL-3.0-or-later
// Displacement fields as transforms in ITK's HDF5 format (.h5): read by ITK 5, SimpleITK, 3D
// Slicer, ANTs and their kin. Written with HDF5 alone.
//
//   /TransformGroup/0/TransformType             "DisplacementFieldTransform_double_3_3", one ASCII
//                                               string of variable length
//   /TransformGroup/0/TransformFixedParameters  18 doubles: size, origin, spacing, direction row by
//                                               row; LPS
//   /TransformGroup/0/TransformParameters       3 doubles per voxel, x fastest; LPS, mm; deflated
//   attributes of the root                      direction, frame, length_unit, note (our own)
//
// The transform maps x to x + v(x). ITK resamples with T(x) as the place in the image that is
// asked: that is direction `resampling`. 3D Slicer loads the file as a transform from parent.
// Source: ITK 5.2, Modules/IO/TransformHDF5 and itkDisplacementFieldTransform.hxx.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "common/io/fields/displacement_field.hpp"

namespace brainshift::io {

// Errors of validate(), with the path in front; kUnreadable for another extension; kWriteFailed.
// The file appears whole or not at all.
Status write_itk_transform(const std::filesystem::path& path, const DisplacementField& field);

}  // namespace brainshift::io
