// SPDX-License-Identifier: GPL-3.0-or-later
// What ImageRegistrar refuses before it works; the sentences name the value.
#pragma once

#include "common/registration/image_registration.hpp"

namespace brainshift::registration {

Status check_options(const ImageRegistrationOptions& options);

// what: "MRI" or "region".
Status check_image(const char* what, const VoxelImage& image);

Status check_samples(const IntensitySamples& samples);

}  // namespace brainshift::registration
