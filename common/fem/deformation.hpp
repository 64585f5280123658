// SPDX-License-Identifier: GPL-3.0-or-later
// Volume ratio of the elements under a displacement: does it turn elements inside out?
//
//   J = det F = V(x + u) / V(x),   F = I + grad u      constant in a tetrahedron; inverted: J <= 0
//
// Small-strain elasticity stretches a tetrahedron through itself without any sign of trouble. J
// tells when an answer has left the range in which it has a meaning.
//
// How much volume tissue loses is told by the nodal volume ratio
//
//   J_a = sum of V_e(x + u) / sum of V_e(x)   over the tetrahedra e about node a
//
// (Bonet and Burton 1998, Commun Numer Meth Eng 14:437). J of a single tetrahedron is no measure of
// that: linear elements of nearly incompressible tissue balance a loss in one with a gain in the
// next, and flat ones most of all.
#pragma once

#include <vector>

#include "common/core/mesh.hpp"
#include "common/core/thread_team.hpp"

namespace brainshift::fem {

struct Deformation {
  double min_volume_ratio = 1.0;  // the smallest J; NaN where u is not finite
  // The smallest J_a. Computed where min_volume_ratio is below kVolumeInQuestion; elsewhere
  // min_volume_ratio, which no J_a falls below. NaN where u is not finite.
  double min_nodal_volume_ratio = 1.0;
  int worst_tet = -1;  // the tetrahedron with the smallest J; -1 without tetrahedra
  int inverted = 0;    // tetrahedra with J <= 0 or not finite
};

inline constexpr double kVolumeInQuestion = 0.6;

// u: 3 x n, mm.
Deformation measure_deformation(const TetMesh& mesh, const Points& u);

// The same for many displacements of one mesh, 3 to 4 ns per tetrahedron and core. It computes in
// single precision, and again in double where J is below 0.1 or the element is so flat that
// single precision cannot decide. So `inverted` is exact and min_volume_ratio is good to 1 %;
// min_nodal_volume_ratio is in double.
// Does not allocate after construction. Not thread-safe.
class DeformationCheck {
 public:
  // team: the threads that measure() runs on; keeps a reference. Copies the mesh.
  DeformationCheck(const Points& nodes, const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets,
                   ThreadTeam& team);
  Deformation measure(const Points& u);

 private:
  double exact_ratio(long tet, const Points& u) const;
  double least_nodal_ratio(const Points& u);
  void measure_part(long begin, long end, const Points& u, Deformation& part) const;

  ThreadTeam& team_;
  Points nodes_;
  Eigen::Matrix<int, 4, Eigen::Dynamic> tets_;
  Vec3 centre_;
  Eigen::Matrix<float, 4, Eigen::Dynamic> deformed_;  // x + u - centre, 0
  std::vector<float> inverse_volume_;                 // 1 / 6V; NaN: always in double
  std::vector<Deformation> parts_;                    // one per member of the team
  VecX nodal_volume_, moved_nodal_volume_;            // 6 times the volumes about each node, mm^3
};

}  // namespace brainshift::fem
