// SPDX-License-Identifier: GPL-3.0-or-later
// Does a displacement turn elements inside out?
//
//   J = det F = V(x + u) / V(x),    F = I + grad u      constant in a linear tetrahedron; inverted: J <= 0
//
// Small-strain elasticity does not know: it stretches a tetrahedron through itself without a sign of trouble. J is
// what tells that an answer left the range in which it means something.
#pragma once

#include <vector>

#include "common/core/mesh.hpp"
#include "common/core/thread_team.hpp"

namespace brainshift::fem {

struct Deformation {
  double min_volume_ratio = 1.0;  // the smallest J; NaN where u is not finite
  int worst_tet = -1;             // that has it; -1 without tetrahedra
  int inverted = 0;               // tetrahedra with J <= 0 or not finite
};

// u: 3 x n, mm.
Deformation measure_deformation(const TetMesh& mesh, const Points& u);

// The same for many displacements of one mesh, 3 to 4 ns per tetrahedron and core: in single precision, and again in
// double wherever J comes out below 0.1 or the element is so flat that single precision would not tell. So
// `inverted` is exact and min_volume_ratio good to 1 %. Does not allocate after construction. Not thread-safe.
class DeformationCheck {
 public:
  // team: that will call measure(); keeps a reference. Copies the mesh.
  DeformationCheck(const Points& nodes, const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets,
                   ThreadTeam& team);
  Deformation measure(const Points& u);

 private:
  double exact_ratio(long tet, const Points& u) const;
  void measure_part(long begin, long end, const Points& u, Deformation& part) const;

  ThreadTeam& team_;
  Points nodes_;
  Eigen::Matrix<int, 4, Eigen::Dynamic> tets_;
  Vec3 centre_;
  Eigen::Matrix<float, 4, Eigen::Dynamic> deformed_;  // x + u - centre, 0
  std::vector<float> inverse_volume_;                 // 1 / 6V; NaN: in double always
  std::vector<Deformation> parts_;                    // one per member of the team
};

}  // namespace brainshift::fem
