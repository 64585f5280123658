// SPDX-License-Identifier: Apache-2.0
#include "common/igtl/tracking.hpp"

#include "common/igtl/bytes.hpp"
#include "common/igtl/header.hpp"

namespace brainshift::igtl {
namespace {

constexpr std::size_t kMatrixBytes = 48;
constexpr std::size_t kToolBytes = 70;

void append_matrix(std::string& out, const Matrix34f& matrix) {
  for (Eigen::Index i = 0; i < matrix.size(); ++i) append_number(out, matrix.data()[i]);
}

Matrix34f take_matrix(ByteReader& reader) {
  Matrix34f matrix;
  for (Eigen::Index i = 0; i < matrix.size(); ++i) matrix.data()[i] = reader.real();
  return matrix;
}

}  // namespace

static_assert(!Matrix34f::IsRowMajor);  // the messages have columns, too

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
  if (content.size() != kMatrixBytes) {
    return malformed(std::to_string(content.size()) + " bytes, must be " +
                     std::to_string(kMatrixBytes));
  }
  ByteReader reader(content);
  const Transform transform{take_matrix(reader)};
  if (const Status status = validate(transform); !status) return malformed(status.error().message);
  return transform;
}

Result<TrackingData> decode_tracking_data(std::string_view content) {
  if (content.size() % kToolBytes != 0) {
    return malformed(std::to_string(content.size()) + " bytes, must be a multiple of " +
                     std::to_string(kToolBytes));
  }
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

}  // namespace brainshift::igtl
