// SPDX-License-Identifier: Apache-2.0
// Protobuf fields <-> core values, with the checks that every received number must pass.
// Lengths are mm, directions and rotations have no unit, coordinates are patient RAS.
// Private to common/wire: it includes the Protobuf header.
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
#include "common/values/session_state.hpp"

namespace brainshift::wire {

namespace pb = brainshift::v1;

template <int Rows>
using IndexColumns = Eigen::Matrix<int, Rows, Eigen::Dynamic>;

// Converts fields and remembers the first invalid one. A decoder converts all fields and asks
// status() once; when it holds an error, the converted values mean nothing.
// Every error names its field.
class Checked {
 public:
  // kNotFinite: the number is not finite.
  double number(double value, std::string_view field);
  // kNotFinite as above; kProtocol: the number is negative.
  double non_negative(double value, std::string_view field);
  // kProtocol: the count does not fit an int.
  int count(std::uint32_t value, std::string_view field);

  // Three finite numbers; kProtocol: the length differs from 1 by more than 1e-3. Kept as sent.
  Vec3 unit_vector(const google::protobuf::RepeatedField<double>& xyz, std::string_view field);
  // Mean of any sign, standard deviation not negative.
  MeanStd mean_std(const pb::MeanStd& value, std::string_view field);
  // 9 + 3 finite numbers; kProtocol: R^T R differs from I by more than 1e-6, or a reflection.
  RigidTransform rigid(const pb::Rigid& value, std::string_view field);

  // 3 x n. A multiple of 3 numbers, at most kMaxPoints points, all finite.
  Points points(const pb::PointSet& value, std::string_view field);
  Points points(const google::protobuf::RepeatedField<float>& xyz, std::string_view field);
  // At most kMaxPoints finite numbers.
  VecX numbers(const google::protobuf::RepeatedField<float>& values, std::string_view field);
  // kNotFinite; kProtocol: not from 0 to 1, but for the rounding of a sum. Kept as sent.
  double share(double value, std::string_view field);

  // 0-based indices in [0, limit), at most kMaxPoints.
  std::vector<int> indices(const google::protobuf::RepeatedField<std::int32_t>& values, int limit,
                           std::string_view field);
  // The same, `Rows` to a column (triangles, tetrahedra).
  template <int Rows>
  IndexColumns<Rows> index_columns(const google::protobuf::RepeatedField<std::int32_t>& values,
                                   int limit, std::string_view field);
  // Vertices, and triangles whose indices name them.
  TriangleSurface surface(const pb::Surface& value, std::string_view field);

  // Any further condition. `detail` completes the sentence "<field>: ". Returns ok().
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

// Any key is valid: what it names is the session's to judge.
SessionKey session_key_from(const pb::SessionKey& value);

// Core values into Protobuf fields. Float fields round to 32 bits.
void set(const Points& points, pb::PointSet* out);
void set(const Points& points, google::protobuf::RepeatedField<float>* xyz);
void set(const VecX& values, google::protobuf::RepeatedField<float>* out);
// Shares from 0 to 1 as bytes from 0 to 255. What is no number counts as 0: nothing is known of it.
std::string to_bytes(const VecX& shares);
VecX from_bytes(std::string_view bytes);
void set(const std::vector<int>& values, google::protobuf::RepeatedField<std::int32_t>* out);
void set(const TriangleSurface& surface, pb::Surface* out);
void set(const Vec3& vector, google::protobuf::RepeatedField<double>* xyz);
void set(const MeanStd& value, pb::MeanStd* out);
void set(const RigidTransform& T, pb::Rigid* out);
void set(const SessionKey& key, pb::SessionKey* out);

template <int Rows>
void set(const IndexColumns<Rows>& columns, google::protobuf::RepeatedField<std::int32_t>* out) {
  out->Add(columns.data(), columns.data() + columns.size());
}

}  // namespace brainshift::wire
