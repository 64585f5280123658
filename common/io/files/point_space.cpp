// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/point_space.hpp"

#include <string>

namespace brainshift::io {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";
constexpr std::size_t kLongestShown = 20;

// A file may hold anything: one short line of printable characters.
std::string shown(std::string_view value) {
  std::string text(value.substr(0, kLongestShown));
  for (char& c : text) {
    if (c < ' ' || c > '~') c = '?';
  }
  return value.size() > kLongestShown ? text + "..." : text;
}

}  // namespace

Result<PointSpace> parse_point_space(std::string_view value) {
  const std::size_t begin = std::min(value.find_first_not_of(kBlanks), value.size());
  const std::string_view word =
      value.substr(begin, value.find_last_not_of(kBlanks) + 1 - begin);  // npos + 1 is 0
  if (word == "RAS") return PointSpace::kRas;
  if (word == "LPS") return PointSpace::kLps;
  return fail(ErrorCode::kUnreadable, "SPACE is '" + shown(word) + "': must be RAS or LPS");
}

Result<PointSpace> point_space_in(std::string_view text) {
  constexpr std::string_view kKey = "SPACE=";
  for (std::size_t at = text.find(kKey); at != std::string_view::npos;
       at = text.find(kKey, at + 1)) {
    if (at > 0 && kBlanks.find(text[at - 1]) == std::string_view::npos) continue;
    const std::string_view value = text.substr(at + kKey.size());
    return parse_point_space(value.substr(0, value.find_first_of(kBlanks)));
  }
  return PointSpace::kUnsaid;
}

void turn_to_ras(PointSpace space, Eigen::Ref<Points> columns) {
  if (space == PointSpace::kLps) columns.topRows<2>() *= -1.0;
}

}  // namespace brainshift::io
