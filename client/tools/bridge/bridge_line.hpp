// SPDX-License-Identifier: GPL-3.0-or-later
// What `brainshift bridge` prints: a line for every field that is shown, and for what happens.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "client/tools/bridge/shown_state.hpp"

namespace brainshift::client {

struct ShownLine {
  ShownState state;
  std::array<int, 3> dims{0, 0, 0};
  double made_ms = 0.0;  // sampling the grid and moving the surfaces
  int clients = 0;
  std::uint64_t replaced = 0;  // pictures that slow clients did not get, so far
};

// "update 12  age 0.08 s  good, current  62 x 58 x 60 voxels, 2 mm, error 0.11 mm  4.2 ms
//  2 clients"; json: an object with the event "update".
std::string shown_line(const ShownLine& line, bool json);
// The sentence itself; json: an object with the event "note".
std::string note_line(const std::string& sentence, bool json);

}  // namespace brainshift::client
