// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/tracking/transform_name.hpp"

namespace brainshift::tracking {
namespace {

bool is_capital(char c) { return c >= 'A' && c <= 'Z'; }

}  // namespace

Result<FramePair> parse_transform_name(std::string_view name) {
  int found = 0;
  std::size_t at = 0;
  for (std::size_t i = 1; i + 2 < name.size(); ++i) {
    if (name.substr(i, 2) == "To" && is_capital(name[i + 2])) {
      at = i;
      ++found;
    }
  }
  if (found != 1 || !is_capital(name.front())) {
    return invalid("transform name \"" + std::string(name) +
                   "\": must be two frame names with capital letters joined by one \"To\"");
  }
  return FramePair{std::string(name.substr(0, at)), std::string(name.substr(at + 2))};
}

bool is_image_frame(std::string_view frame) { return frame.ends_with("Image"); }

}  // namespace brainshift::tracking
