// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/point_list.hpp"

#include <cmath>

#include "common/igtl/bytes.hpp"

namespace brainshift::igtl {
namespace {

constexpr std::size_t kPointBytes = 136;
constexpr std::size_t kNameBytes = 64;
constexpr std::size_t kGroupBytes = 32;
constexpr std::size_t kOwnerBytes = 20;

Status validate_point(const NamedPoint& point) {
  const Status texts =
      check_padded("name of a point", point.name, kNameBytes)
          .and_then([&] { return check_padded("group of a point", point.group, kGroupBytes); })
          .and_then([&] { return check_padded("owner of a point", point.owner, kOwnerBytes); });
  if (!texts) return texts;
  if (!point.position.allFinite() || !std::isfinite(point.diameter)) {
    return fail(ErrorCode::kNotFinite, "position or diameter of a point is not finite");
  }
  return {};
}

}  // namespace

Status validate(const PointList& list) {
  for (const NamedPoint& point : list.points) {
    if (Status status = validate_point(point); !status) return status;
  }
  return {};
}

void append_content(const PointList& list, std::string& out) {
  for (const NamedPoint& point : list.points) {
    append_padded(out, point.name, kNameBytes);
    append_padded(out, point.group, kGroupBytes);
    for (const std::uint8_t part : point.rgba) append_number(out, part);
    for (const float coordinate : point.position) append_number(out, coordinate);
    append_number(out, point.diameter);
    append_padded(out, point.owner, kOwnerBytes);
  }
}

Result<PointList> decode_point_list(std::string_view content) {
  if (content.size() % kPointBytes != 0) {
    return malformed(std::to_string(content.size()) + " bytes, must be a multiple of " +
                     std::to_string(kPointBytes));
  }
  PointList list;
  for (ByteReader reader(content); reader.left() > 0;) {
    NamedPoint point;
    point.name = reader.take_padded(kNameBytes);
    point.group = reader.take_padded(kGroupBytes);
    for (std::uint8_t& part : point.rgba) part = reader.number<std::uint8_t>();
    for (float& coordinate : point.position) coordinate = reader.real();
    point.diameter = reader.real();
    point.owner = reader.take_padded(kOwnerBytes);
    list.points.push_back(std::move(point));
  }
  if (const Status status = validate(list); !status) return malformed(status.error().message);
  return list;
}

}  // namespace brainshift::igtl
