// SPDX-License-Identifier: Apache-2.0
#include "common/wire/checked_values.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "common/core/text.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::wire {
namespace {

using google::protobuf::RepeatedField;

// A direction sent with three decimals passes. Values are kept as sent.
constexpr double kUnitTolerance = 1e-3;
constexpr double kRotationTolerance = 1e-6;
constexpr double kShareTolerance = 1e-9;
constexpr double kByteMax = 255.0;
// Head meshes have 5.5 tetrahedra per node; 8 leaves room for any sound mesh.
constexpr int kMaxCells = 8 * kMaxPoints;

std::string show(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

template <typename T>
int first_not_finite(const RepeatedField<T>& values) {
  const auto it =
      std::find_if_not(values.begin(), values.end(), [](T value) { return std::isfinite(value); });
  return it == values.end() ? -1 : static_cast<int>(it - values.begin());
}

template <typename T>
bool require_finite(Checked& checked, const RepeatedField<T>& values, std::string_view field) {
  const int bad = first_not_finite(values);
  return checked.require(bad < 0, field, "entry " + std::to_string(bad) + " is not finite",
                         ErrorCode::kNotFinite);
}

}  // namespace

bool Checked::require(bool holds, std::string_view field, std::string_view detail, ErrorCode code) {
  if (!holds && ok()) status_ = fail(code, std::string(field) + ": " + std::string(detail));
  return ok();
}

double Checked::number(double value, std::string_view field) {
  if (!std::isfinite(value)) require(false, field, "is not finite", ErrorCode::kNotFinite);
  return value;
}

double Checked::non_negative(double value, std::string_view field) {
  number(value, field);
  if (value < 0.0) require(false, field, show(value) + ", must not be negative");
  return value;
}

double Checked::share(double value, std::string_view field) {
  non_negative(value, field);
  require(value <= 1.0 + kShareTolerance, field, show(value) + ", must be at most 1");
  return value;
}

int Checked::count(std::uint32_t value, std::string_view field) {
  constexpr auto limit = static_cast<std::uint32_t>(std::numeric_limits<int>::max());
  require(value <= limit, field, std::to_string(value) + " is too large");
  return static_cast<int>(std::min(value, limit));
}

Vec3 Checked::unit_vector(const RepeatedField<double>& xyz, std::string_view field) {
  if (!require(xyz.size() == 3, field, std::to_string(xyz.size()) + " numbers, must be 3"))
    return {};
  if (!require_finite(*this, xyz, field)) return {};
  Vec3 vector(xyz[0], xyz[1], xyz[2]);
  require(std::abs(vector.norm() - 1.0) <= kUnitTolerance, field,
          "length " + show(vector.norm()) + ", must be 1");
  return vector;
}

MeanStd Checked::mean_std(const pb::MeanStd& value, std::string_view field) {
  return {number(value.mean_mm(), std::string(field) + ".mean_mm"),
          non_negative(value.std_mm(), std::string(field) + ".std_mm")};
}

RigidTransform Checked::rigid(const pb::Rigid& value, std::string_view field) {
  RigidTransform T = RigidTransform::Identity();
  const auto& r = value.rotation_row_major();
  const auto& t = value.translation_mm();
  const std::string rotation = std::string(field) + ".rotation_row_major";
  const std::string translation = std::string(field) + ".translation_mm";
  if (!require(r.size() == 9, rotation, std::to_string(r.size()) + " numbers, must be 9") ||
      !require(t.size() == 3, translation, std::to_string(t.size()) + " numbers, must be 3") ||
      !require_finite(*this, r, rotation) || !require_finite(*this, t, translation)) {
    return T;
  }
  Mat3 R;
  R << r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8];
  const double defect = (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff();
  require(defect <= kRotationTolerance && R.determinant() > 0.0, rotation, "must be a rotation");
  T.linear() = R;
  T.translation() = Vec3(t[0], t[1], t[2]);
  return T;
}

void Checked::check_columns(int size, int rows, int max_columns, std::string_view field) {
  require(size % rows == 0, field,
          std::to_string(size) + " numbers, must be a multiple of " + std::to_string(rows));
  require(size / rows <= max_columns, field,
          std::to_string(size / rows) + " entries, must be at most " + std::to_string(max_columns));
}

Points Checked::points(const pb::PointSet& value, std::string_view field) {
  const auto& xyz = value.xyz_mm();
  const std::string name = std::string(field) + ".xyz_mm";
  check_columns(xyz.size(), 3, kMaxPoints, name);
  if (!ok() || !require_finite(*this, xyz, name)) return {};
  return Eigen::Map<const Points>(xyz.data(), 3, xyz.size() / 3);
}

Points Checked::points(const RepeatedField<float>& xyz, std::string_view field) {
  check_columns(xyz.size(), 3, kMaxPoints, field);
  if (!ok() || !require_finite(*this, xyz, field)) return {};
  return Eigen::Map<const Eigen::Matrix3Xf>(xyz.data(), 3, xyz.size() / 3).cast<double>();
}

VecX Checked::numbers(const RepeatedField<float>& values, std::string_view field) {
  check_columns(values.size(), 1, kMaxPoints, field);
  if (!ok() || !require_finite(*this, values, field)) return {};
  return Eigen::Map<const Eigen::VectorXf>(values.data(), values.size()).cast<double>();
}

void Checked::check_range(const RepeatedField<std::int32_t>& values, int limit,
                          std::string_view field) {
  const auto bad = std::find_if(values.begin(), values.end(),
                                [&](std::int32_t i) { return i < 0 || i >= limit; });
  if (bad == values.end()) return;
  require(false, field,
          "index " + std::to_string(*bad) + ", must be in [0, " + std::to_string(limit) + ")");
}

std::vector<int> Checked::indices(const RepeatedField<std::int32_t>& values, int limit,
                                  std::string_view field) {
  check_columns(values.size(), 1, kMaxPoints, field);
  check_range(values, limit, field);
  if (!ok()) return {};
  return {values.begin(), values.end()};
}

template <int Rows>
IndexColumns<Rows> Checked::index_columns(const RepeatedField<std::int32_t>& values, int limit,
                                          std::string_view field) {
  check_columns(values.size(), Rows, kMaxCells, field);
  check_range(values, limit, field);
  if (!ok()) return {};
  return Eigen::Map<const IndexColumns<Rows>>(values.data(), Rows, values.size() / Rows);
}
template IndexColumns<3> Checked::index_columns<3>(const RepeatedField<std::int32_t>&, int,
                                                   std::string_view);
template IndexColumns<4> Checked::index_columns<4>(const RepeatedField<std::int32_t>&, int,
                                                   std::string_view);

TriangleSurface Checked::surface(const pb::Surface& value, std::string_view field) {
  TriangleSurface surface;
  surface.vertices = points(value.vertices(), std::string(field) + ".vertices");
  surface.triangles = index_columns<3>(value.triangle_indices(), surface.num_vertices(),
                                       std::string(field) + ".triangle_indices");
  return surface;
}

SessionKey session_key_from(const pb::SessionKey& value) {
  return {value.boot_id(), value.session_id(), value.model_id()};
}

void set(const SessionKey& key, pb::SessionKey* out) {
  out->set_boot_id(key.boot_id);
  out->set_session_id(key.session_id);
  out->set_model_id(to_utf8(key.model_id));
}

void set(const Points& points, pb::PointSet* out) {
  out->mutable_xyz_mm()->Add(points.data(), points.data() + points.size());
}

void set(const Points& points, RepeatedField<float>* xyz) {
  xyz->Resize(static_cast<int>(points.size()), 0.0f);
  Eigen::Map<Eigen::Matrix3Xf>(xyz->mutable_data(), 3, points.cols()) = points.cast<float>();
}

void set(const VecX& values, RepeatedField<float>* out) {
  out->Resize(static_cast<int>(values.size()), 0.0f);
  Eigen::Map<Eigen::VectorXf>(out->mutable_data(), values.size()) = values.cast<float>();
}

std::string to_bytes(const VecX& shares) {
  std::string bytes(static_cast<std::size_t>(shares.size()), '\0');
  std::transform(shares.begin(), shares.end(), bytes.begin(), [](double share) {
    const double byte = share > 0.0 ? kByteMax * std::min(share, 1.0) + 0.5 : 0.0;
    return static_cast<char>(static_cast<unsigned char>(byte));
  });
  return bytes;
}

VecX from_bytes(std::string_view bytes) {
  return VecX::NullaryExpr(static_cast<Eigen::Index>(bytes.size()), [&](Eigen::Index i) {
    return static_cast<unsigned char>(bytes[static_cast<std::size_t>(i)]) / kByteMax;
  });
}

void set(const std::vector<int>& values, RepeatedField<std::int32_t>* out) {
  out->Add(values.begin(), values.end());
}

void set(const TriangleSurface& surface, pb::Surface* out) {
  set(surface.vertices, out->mutable_vertices());
  set<3>(surface.triangles, out->mutable_triangle_indices());
}

void set(const Vec3& vector, RepeatedField<double>* xyz) {
  xyz->Add(vector.data(), vector.data() + 3);
}

void set(const MeanStd& value, pb::MeanStd* out) {
  out->set_mean_mm(value.mean);
  out->set_std_mm(value.std);
}

void set(const RigidTransform& T, pb::Rigid* out) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) out->add_rotation_row_major(T.linear()(row, column));
  }
  set(Vec3(T.translation()), out->mutable_translation_mm());
}

}  // namespace brainshift::wire
