// SPDX-License-Identifier: GPL-3.0-or-later
// Volume ratio of the elements under a displacement: does it turn elements inside out?
//
//   J = det F = V(x + u) / V(x),   F = I + grad u      constant in a tetrahedron; inverted: J <= 0
//
// Small-strain elasticity stretches a tetrahedron through itself without any sign of trouble. J
// tells when an answer has left the range in which it has a meaning.
#pragma once

#include <vector>

#include "common/core/mesh.hpp"
#include "common/core/thread_team.hpp"

namespace brainshift::fem {

struct Deformation {
  double min_volume_ratio = 1.0;  // the smallest J; NaN where u is not finite
  int worst_tet = -1;             // the tetrahedron with the smallest J; -1 without tetrahedra
  int inverted = 0;               // tetrahedra with J <= 0 or not finite
};

// u: 3 x n, mm.
Deformation measure_deformation(const TetMesh& mesh, const Points& u);

// The same for many displacements of one mesh, 3 to 4 ns per tetrahedron and core. It computes in
// single precision, and again in double where J is below 0.1 or the element is so flat that
// single precision cannot decide. So `inverted` is exact and min_volume_ratio is good to 1 %.
// Does not allocate after construction. Not thread-safe.
class DeformationCheck {
 public:
  // team: the threads that measure() runs on; keeps a reference. Copies the mesh.
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
  std::vector<float> inverse_volume_;                 // 1 / 6V; NaN: always in double
  std::vector<Deformation> parts_;                    // one per member of the team
};

}  // namespace brainshift::fem
