// SPDX-License-Identifier: Apache-2.0
// Protobuf fields <-> core values, with the checks that every received number must pass.
// Private to common/wire.
#pragma once

#include <google/protobuf/repeated_field.h>

#include <string>
#include <string_view>
#include <vector>

#include "brainshift/v1/brainshift.pb.h"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/statistics.hpp"
#include "common/core/types.hpp"

namespace brainshift::wire {

namespace pb = brainshift::v1;

template <int Rows>
using IndexColumns = Eigen::Matrix<int, Rows, Eigen::Dynamic>;

// Converts fields and remembers the first that is wrong; after that every conversion returns an empty
// value. A decoder converts all fields and asks status() once.
class Checked {
 public:
  // A finite number (kNotFinite otherwise), and one that is not negative (kProtocol).
  double number(double value, std::string_view field);
  double non_negative(double value, std::string_view field);
  // A count that fits the core's int.
  int count(std::uint32_t value, std::string_view field);

  Vec3 unit_vector(const google::protobuf::RepeatedField<double>& xyz, std::string_view field);
  MeanStd mean_std(const pb::MeanStd& value, std::string_view field);
  RigidTransform rigid(const pb::Rigid& value, std::string_view field);

  // Multiple of 3 numbers, at most kMaxPoints points, all finite.
  Points points(const pb::PointSet& value, std::string_view field);
  Points points(const google::protobuf::RepeatedField<float>& xyz, std::string_view field);
  // At most kMaxPoints finite numbers.
  VecX numbers(const google::protobuf::RepeatedField<float>& values, std::string_view field);

  // Indices in [0, limit).
  std::vector<int> indices(const google::protobuf::RepeatedField<std::int32_t>& values, int limit,
                           std::string_view field);
  template <int Rows>
  IndexColumns<Rows> index_columns(const google::protobuf::RepeatedField<std::int32_t>& values,
                                   int limit, std::string_view field);
  TriangleSurface surface(const pb::Surface& value, std::string_view field);

  // Any further condition; `detail` says what must hold.
  bool require(bool holds, std::string_view field, std::string_view detail,
               ErrorCode code = ErrorCode::kProtocol);

  bool ok() const { return status_.has_value(); }
  const Status& status() const { return status_; }

 private:
  void check_columns(int size, int rows, int max_columns, std::string_view field);
  void check_range(const google::protobuf::RepeatedField<std::int32_t>& values, int limit,
                   std::string_view field);

  Status status_;
};

void set(const Points& points, pb::PointSet* out);
void set(const Points& points, google::protobuf::RepeatedField<float>* xyz);
void set(const VecX& values, google::protobuf::RepeatedField<float>* out);
void set(const std::vector<int>& values, google::protobuf::RepeatedField<std::int32_t>* out);
void set(const TriangleSurface& surface, pb::Surface* out);
void set(const Vec3& vector, google::protobuf::RepeatedField<double>* xyz);
void set(const MeanStd& value, pb::MeanStd* out);
void set(const RigidTransform& T, pb::Rigid* out);

template <int Rows>
void set(const IndexColumns<Rows>& columns, google::protobuf::RepeatedField<std::int32_t>* out) {
  out->Add(columns.data(), columns.data() + columns.size());
}

}  // namespace brainshift::wire
