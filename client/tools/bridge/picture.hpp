// SPDX-License-Identifier: GPL-3.0-or-later
// Picture: what OpenIGTLink clients are shown at one moment. A value that is not changed any more
// once it is made; the threads share it.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "client/tools/bridge/shown_state.hpp"
#include "common/igtl/header.hpp"
#include "common/igtl/image.hpp"
#include "common/igtl/poly_data.hpp"

namespace brainshift::client {

// What stays the same for as long as the model does.
struct Rest {
  igtl::ImageGeometry geometry;
  bool with_sd = true;  // volume and attribute sd_mm
  // Undeformed, with attributes of zeros; empty when surfaces are not wanted.
  std::optional<igtl::PolyData> tumour;
  std::optional<igtl::PolyData> cortex;
};

struct Picture {
  ShownState state;
  igtl::Timestamp time = 0;  // when it was made
  // Null: no model is known yet, and there is nothing but the state.
  std::shared_ptr<const Rest> rest;
  // Empty when blank, which stands for zeros.
  std::vector<float> u;   // 3 per voxel, mm
  std::vector<float> sd;  // 1 per voxel, mm
  std::optional<igtl::PolyData> tumour;
  std::optional<igtl::PolyData> cortex;
};
using PicturePtr = std::shared_ptr<const Picture>;

// Now, by the wall clock.
igtl::Timestamp time_now();
// Zeros, and the surfaces as they were before surgery. state.blank and its figures of a field are
// set to say so; session, model, case, currency, quality and reason are the caller's.
PicturePtr blank_picture(const std::shared_ptr<const Rest>& rest, ShownState state);

}  // namespace brainshift::client
