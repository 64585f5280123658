// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/short_contents.hpp"

#include <cmath>

#include "common/igtl/bytes.hpp"
#include "common/igtl/header.hpp"

namespace brainshift::igtl {
namespace {

constexpr std::size_t kTextHeaderBytes = 4;
constexpr std::size_t kErrorNameBytes = 20;
constexpr std::size_t kStatusHeaderBytes = 2 + 8 + kErrorNameBytes;
constexpr std::size_t kMatrixBytes = 48;
constexpr std::size_t kToolBytes = 70;
constexpr std::size_t kPointBytes = 136;
constexpr std::size_t kNameBytes = 64;
constexpr std::size_t kGroupBytes = 32;
constexpr std::size_t kOwnerBytes = 20;

static_assert(!Matrix34f::IsRowMajor);  // the messages have columns, too

void append_matrix(std::string& out, const Matrix34f& matrix) {
  for (Eigen::Index i = 0; i < matrix.size(); ++i) append_number(out, matrix.data()[i]);
}

Matrix34f take_matrix(ByteReader& reader) {
  Matrix34f matrix;
  for (Eigen::Index i = 0; i < matrix.size(); ++i) matrix.data()[i] = reader.real();
  return matrix;
}

Status validate_point(const NamedPoint& point) {
  Status texts =
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

Status validate(const Text& text) {
  if (text.text.size() > Text::kMaxBytes) {
    return invalid("text has " + std::to_string(text.text.size()) + " bytes, must have at most " +
                   std::to_string(Text::kMaxBytes));
  }
  return {};
}

Status validate(const StatusReport& report) {
  if (Status status = check_padded("error name", report.error_name, kErrorNameBytes); !status) {
    return status;
  }
  return check_padded("text", report.text, StatusReport::kMaxTextBytes);
}

Status validate(const Capability& capability) {
  for (const std::string& type : capability.types) {
    if (type.empty()) return invalid("a message type is empty");
    if (Status status = check_padded("message type", type, kMaxTypeBytes); !status) return status;
  }
  return {};
}

void append_content(const Text& text, std::string& out) {
  append_number(out, text.encoding);
  append_number(out, static_cast<std::uint16_t>(text.text.size()));
  out.append(text.text);
}

void append_content(const StatusReport& report, std::string& out) {
  append_number(out, report.code);
  append_number(out, report.subcode);
  append_padded(out, report.error_name, kErrorNameBytes);
  out.append(report.text).push_back('\0');
}

void append_content(const Capability& capability, std::string& out) {
  for (const std::string& type : capability.types) append_padded(out, type, kMaxTypeBytes);
}

Result<Text> decode_text(std::string_view content) {
  if (content.size() < kTextHeaderBytes) return wrong_size(content, "at least ", kTextHeaderBytes);
  ByteReader reader(content);
  Text text;
  text.encoding = reader.number<std::uint16_t>();
  const auto bytes = reader.number<std::uint16_t>();
  if (bytes != reader.left()) {
    return malformed("text of " + std::to_string(bytes) + " bytes, " +
                     std::to_string(reader.left()) + " are left");
  }
  text.text = reader.rest();
  return text;
}

Result<StatusReport> decode_status_report(std::string_view content) {
  if (content.size() < kStatusHeaderBytes)
    return wrong_size(content, "at least ", kStatusHeaderBytes);
  ByteReader reader(content);
  StatusReport report;
  report.code = reader.number<std::uint16_t>();
  report.subcode = reader.number<std::int64_t>();
  report.error_name = reader.take_padded(kErrorNameBytes);
  report.text = reader.take_padded(reader.left());
  if (const Status status = validate(report); !status) return malformed(status.error().message);
  return report;
}

Result<Capability> decode_capability(std::string_view content) {
  if (content.size() % kMaxTypeBytes != 0)
    return wrong_size(content, "a multiple of ", kMaxTypeBytes);
  Capability capability;
  for (ByteReader reader(content); reader.left() > 0;) {
    capability.types.emplace_back(reader.take_padded(kMaxTypeBytes));
  }
  if (const Status status = validate(capability); !status) return malformed(status.error().message);
  return capability;
}

// ---- TRANSFORM, TDATA ----

Eigen::Matrix4d to_matrix(const Matrix34f& transform) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topRows<3>() = transform.cast<double>();
  return matrix;
}

Status validate(const Transform& transform) {
  if (!transform.matrix.allFinite()) {
    return fail(ErrorCode::kNotFinite, "a number of the transform is not finite");
  }
  return {};
}

Status validate(const TrackingData& data) {
  for (const TrackedTool& tool : data.tools) {
    if (Status status = check_padded("name of a tool", tool.name, kMaxDeviceBytes); !status) {
      return status;
    }
    if (!tool.matrix.allFinite()) {
      return fail(ErrorCode::kNotFinite, "a number of the transform is not finite");
    }
  }
  return {};
}

void append_content(const Transform& transform, std::string& out) {
  append_matrix(out, transform.matrix);
}

void append_content(const TrackingData& data, std::string& out) {
  for (const TrackedTool& tool : data.tools) {
    append_padded(out, tool.name, kMaxDeviceBytes);
    append_number(out, static_cast<std::uint8_t>(tool.type));
    append_number(out, std::uint8_t{0});
    append_matrix(out, tool.matrix);
  }
}

Result<Transform> decode_transform(std::string_view content) {
  if (content.size() != kMatrixBytes) return wrong_size(content, "", kMatrixBytes);
  ByteReader reader(content);
  const Transform transform{take_matrix(reader)};
  if (const Status status = validate(transform); !status) return malformed(status.error().message);
  return transform;
}

Result<TrackingData> decode_tracking_data(std::string_view content) {
  if (content.size() % kToolBytes != 0) return wrong_size(content, "a multiple of ", kToolBytes);
  TrackingData data;
  for (ByteReader reader(content); reader.left() > 0;) {
    TrackedTool tool;
    tool.name = reader.take_padded(kMaxDeviceBytes);
    const auto type = reader.number<std::uint8_t>();
    if (type < 1 || type > 4) {
      return malformed("tool type " + std::to_string(type) + ", must be 1 to 4");
    }
    tool.type = static_cast<ToolType>(type);
    reader.number<std::uint8_t>();  // reserved
    tool.matrix = take_matrix(reader);
    data.tools.push_back(std::move(tool));
  }
  if (const Status status = validate(data); !status) return malformed(status.error().message);
  return data;
}

// ---- POINT ----

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
  if (content.size() % kPointBytes != 0) return wrong_size(content, "a multiple of ", kPointBytes);
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
