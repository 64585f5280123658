// SPDX-License-Identifier: GPL-3.0-or-later
// Device set files of the PLUS Toolkit (XML): the constant transforms and how volumes are to be
// reconstructed.
//
//   PlusConfiguration / CoordinateDefinitions / Transform
//       From, To, Matrix (16 numbers, row by row)
//   PlusConfiguration / VolumeReconstruction
//       ClipRectangleOrigin, ClipRectangleSize (pixels), OutputSpacing
//
// ImageToProbe turns pixels into mm: it scales, and its third column is a direction without
// meaning for flat images. Links between frames of bodies must be rigid. The rest of the file is
// not looked at.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/tracking/chain.hpp"

namespace brainshift::io {

struct ClipRectangle {
  std::array<int, 2> origin_px{0, 0};
  std::array<int, 2> size_px{0, 0};
};

struct PlusConfig {
  std::vector<tracking::ConstantLink> transforms;
  std::optional<ClipRectangle> clip;
  std::optional<Vec3> output_spacing_mm;
};

// kNotFound; kUnreadable naming the transform or attribute and its value.
Result<PlusConfig> read_plus_config(const std::filesystem::path& path);

}  // namespace brainshift::io
