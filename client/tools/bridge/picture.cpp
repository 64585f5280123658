// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/picture.hpp"

#include <chrono>
#include <utility>

namespace brainshift::client {

igtl::Timestamp time_now() {
  return igtl::to_timestamp(std::chrono::system_clock::now().time_since_epoch());
}

PicturePtr blank_picture(const std::shared_ptr<const Rest>& rest, ShownState state) {
  state.blank = true;
  state.has_sd = false;
  state.sequence = 0;
  state.grid_error_mm = 0.0;
  auto picture = std::make_shared<Picture>();
  picture->state = std::move(state);
  picture->time = time_now();
  picture->rest = rest;
  return picture;
}

}  // namespace brainshift::client
