// SPDX-License-Identifier: Apache-2.0
// Field: where a point of the MRI is now, how sure that is, and where a point of the operating room
// was in the MRI.
//
//   const auto mesh = FieldMesh::build(*client->model());             // once per model
//   const auto field = Field::of(*mesh, client->latest_usable()->update);   // once per update
//   const FieldValues here = field->at(points);           // of the MRI: points + here.displacement
//   const Undeformed was = field->undeformed(tool_tips);  // of the room: places in the MRI
//
// The field is linear in every tetrahedron of the mesh, x -> x + sum_k w_k(x) u_k with x's
// barycentric weights w_k, and continuous across their faces. So is its inverse in the moved mesh:
// undeformed() finds the moved tetrahedron that holds the point, and is exact but for rounding.
//
// Outside the mesh (skull, air, the gap under the skull) there is no field: `where` says so and the
// numbers are NaN. Nothing is extrapolated. Neither is it where a viewer's part of the update
// (Update::part) leaves out a node of the tetrahedron.
//
// Coordinates are patient RAS, mm; points 3 x m, a column per point. A mesh of 130,000 tetrahedra
// is made ready in some tens of milliseconds, the first undeformed() of an update takes as long,
// a point about a microsecond. Whether the field may be shown at all is for Client::field_status()
// to say: a Field keeps the values of its update, and does not age.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::client {

enum class Where : std::uint8_t {
  kInside,       // there is a value
  kOutside,      // outside the mesh, or not a number
  kNotReceived,  // inside the mesh, but a viewer's part leaves out a value there
};

struct FieldValues {
  std::vector<Where> where;  // m
  Points displacement;       // 3 x m, mm: moves the undeformed point to its deformed place
  VecX sd_mm;                // m, as Estimate::sd_mm; empty when the update has none
  VecX known;                // m, 0 to 1, as Estimate::known; empty when the update has none
};

struct Undeformed {
  std::vector<Where> where;  // m; never kNotReceived: a tetrahedron without a field is nowhere now
  Points points;             // 3 x m, mm: where the deformed points were in the MRI
  FieldValues field;         // of these points
};

// The mesh of a model, ready to be asked. Copies share it. Thread-safe.
class FieldMesh {
 public:
  // kInvalidArgument: a tetrahedron names a node that is none; kNotFinite: a node.
  static Result<FieldMesh> build(const BrainModel& model);

 private:
  friend class Field;
  struct Impl;
  explicit FieldMesh(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<const Impl> impl_;
};

// The field of one update. Copies share it. Thread-safe.
class Field {
 public:
  // kInvalidArgument: the update is of another model or mesh, carries only what changed (those that
  // Client hands out do not), or may not be shown (Update::usable).
  static Result<Field> of(const FieldMesh& mesh, const Update& update);

  // At undeformed places.
  FieldValues at(const Points& points) const;
  // Of deformed places.
  Undeformed undeformed(const Points& points) const;

 private:
  struct Impl;
  explicit Field(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<const Impl> impl_;
};

}  // namespace brainshift::client
