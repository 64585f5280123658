// SPDX-License-Identifier: GPL-3.0-or-later
// Fiducials for the patient registration, from a .csv; lengths mm, '#' begins a comment.
//
//   reference_x,reference_y,reference_z,ras_x,ras_y,ras_z
//       a pair per row: touched by the pointer, and in the image. A heading gives another order:
//       an axis and ref, reference, touched, tracker or measured (or the axis alone), and an axis
//       and ras, image, mri, ct or lps (or r,a,s or l,p,s), perhaps defined (files/table.hpp)
//   reference,x,y,z  and  ras,x,y,z
//       a point per row where the order is not known. The correspondence is found
//       (registration/fiducials.hpp). A heading names list, x, y and z.
// Another heading is refused.
#pragma once

#include <filesystem>

#include "common/core/error.hpp"
#include "common/registration/fiducials.hpp"

namespace brainshift::io {

struct FiducialFile {
  registration::FiducialRegistration fit;  // T_ras_reference is fit.T_image_measured
  bool matched = false;                    // the correspondence was found, not given
};

// kNotFound; kUnreadable naming file and line; the errors of register_fiducials, match_fiducials
// and check_head_fit, naming the file.
Result<FiducialFile> read_fiducials(const std::filesystem::path& path);

}  // namespace brainshift::io
