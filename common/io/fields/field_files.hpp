// SPDX-License-Identifier: GPL-3.0-or-later
// Displacement fields and scalar volumes to files of other programs. All fail with the errors of
// validate(), the path in front; kUnreadable for another extension; kWriteFailed. A file appears
// whole or not at all.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "common/io/fields/displacement_field.hpp"

namespace brainshift::io {

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
// precision, because the axes are at right angles (displacement_field.hpp).
//
// Float32. kRas gives intent 1006, kLps 1007; intent_name is the direction, descrip direction,
// frame and note.
Status write_nifti(const std::filesystem::path& path, const DisplacementField& field,
                   VectorFrame vectors);
// Three-dimensional, float32; descrip is the note.
Status write_nifti(const std::filesystem::path& path, const ScalarVolume& volume);

// Displacement fields to NRRD files (.nrrd): float32, gzip, LPS.
//
// Kinds `vector domain domain domain`; space left-posterior-superior; places and vectors LPS, mm.
// Keys: `intent_code:=1006` and `displacement field type:=resampling|modeling`, by which 3D Slicer
// knows a displacement field and its direction (`modeling` since Slicer 5.10: earlier ones, and
// plastimatch and elastix, take every field for resampling); `brainshift note`.
// Source: teem's definition of NRRD (NRRD0005); Slicer, vtkITKTransformConverter and its NRRD
// reader.
Status write_nrrd(const std::filesystem::path& path, const DisplacementField& field);

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
Status write_itk_transform(const std::filesystem::path& path, const DisplacementField& field);

}  // namespace brainshift::io
