// SPDX-License-Identifier: GPL-3.0-or-later
// The same head in another mesh, with quadratic elements: where a truth comes from that shares
// neither mesh nor element with the estimate.
//
// Its edges are kOtherEdge times as long, but for those near the craniotomy's rim, which a camera
// sees. A quadratic tetrahedron has a node in the middle of every edge. So this mesh has between
// two and three times as many unknowns as the case's, and an error of displacement that falls with
// the third power of the edge instead of the second.
#pragma once

#include <memory>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/fem/displacement_space.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

// Fixed places in a space of linear or quadratic elements, and the displacement there.
class SpacePoints {
 public:
  SpacePoints() = default;
  // points: 3 x m, mm. A point outside the mesh stands for the closest point of the mesh.
  // Precondition: the locator was made of a mesh with a tetrahedron.
  SpacePoints(const geometry::TetLocator& locator, const Points& points);

  // u: 3 x nodes of the space, which is of the locator's mesh. 3 x m.
  Points displacement(const fem::DisplacementSpace& space, const Points& u) const;
  // Of a point outside the mesh; 0: all lie inside.
  double farthest_outside_mm() const { return farthest_mm_; }

 private:
  struct Place {
    int element;
    Eigen::Vector4d l;
  };
  std::vector<Place> places_;
  double farthest_mm_ = 0.0;
};

inline constexpr double kOtherEdge = 1.4;

// The case built again with these edges: mesh, node sets and skull of its own. kInvalidArgument
// when the case names a ready mesh. Otherwise errors of patient::build_patient.
Result<BrainModel> mesh_anew(const CaseConfig& config, const Progress& progress = {});

struct OtherMesh {
  BrainModel model;              // of the other mesh
  fem::DisplacementSpace space;  // quadratic, on its mesh
  geometry::TetLocator locator;  // of its mesh
  SpacePoints nodes, tumour;     // nodes and tumour's vertices of the case's model
};

// The nodes of a model in another mesh of its head, whose locator this is: where both have sheets
// of falx and tentorium, each node of a sheet on its own side (sheets.hpp).
SpacePoints nodes_elsewhere(const BrainModel& model, const BrainModel& other,
                            const geometry::TetLocator& locator);

// model: of the case. other: of the same head; its tumour is not looked at. kInvalidArgument when
// the case's outer surface lies more than kLargestMismatch_mm outside the other mesh somewhere: not
// the same head. A node in a ventricle of the other mesh may be as deep in it as it is wide.
inline constexpr double kLargestMismatch_mm = 5.0;
Result<std::shared_ptr<const OtherMesh>> make_other_mesh(const BrainModel& model, BrainModel other);

}  // namespace brainshift::client
