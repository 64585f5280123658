// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/deformation.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace brainshift::fem {
namespace {

// Below this J the element is computed again in double precision.
constexpr float kSurelyUpright = 0.1F;
// So is an element for which single precision may err by more than this.
constexpr double kRatioError = 0.01;

using Corners = Eigen::Matrix<double, 3, 4>;

// 6 V
double six_volumes(const Corners& x) {
  return Vec3(x.col(1) - x.col(0)).cross(Vec3(x.col(2) - x.col(0))).dot(Vec3(x.col(3) - x.col(0)));
}

// Sum of 1 / height over the four corners, 1/mm: J changes by at most this times a position
// error.
double sum_inverse_heights(const Corners& x) {
  const Vec3 a = x.col(1) - x.col(0), b = x.col(2) - x.col(0), c = x.col(3) - x.col(0);
  const double areas = a.cross(b).norm() + b.cross(c).norm() + c.cross(a).norm() +
                       Vec3(b - a).cross(Vec3(c - a)).norm();
  return areas / std::abs(a.cross(b).dot(c));
}

void include(double ratio, int tet, Deformation& deformation) {
  if (!(ratio > 0.0)) ++deformation.inverted;
  // A NaN stays.
  if (deformation.worst_tet >= 0 && !(ratio < deformation.min_volume_ratio) && !std::isnan(ratio)) {
    return;
  }
  if (deformation.worst_tet >= 0 && std::isnan(deformation.min_volume_ratio)) return;
  deformation.min_volume_ratio = ratio;
  deformation.worst_tet = tet;
}

Corners corners_of(const Points& nodes, const Eigen::Vector4i& tet) {
  Corners x;
  for (int k = 0; k < 4; ++k) x.col(k) = nodes.col(tet[k]);
  return x;
}

Corners moved_corners_of(const Points& nodes, const Eigen::Vector4i& tet, const Points& u) {
  return corners_of(nodes, tet) + corners_of(u, tet);
}

double ratio_of(const Points& nodes, const Eigen::Vector4i& tet, const Points& u) {
  return six_volumes(moved_corners_of(nodes, tet, u)) / six_volumes(corners_of(nodes, tet));
}

void add_volume(const Eigen::Vector4i& tet, double six_volumes, VecX& nodal) {
  for (int k = 0; k < 4; ++k) nodal[tet[k]] += six_volumes;
}

// NaN where a ratio is. A node without a tetrahedron has none.
double least_ratio(const VecX& moved, const VecX& rest) {
  double least = 1.0;
  bool any = false;
  for (Eigen::Index node = 0; node < rest.size(); ++node) {
    if (rest[node] == 0.0) continue;
    const double ratio = moved[node] / rest[node];
    if (std::isnan(ratio)) return ratio;
    if (!any || ratio < least) least = ratio;
    any = true;
  }
  return least;
}

bool in_question(const Deformation& deformation) {
  return !(deformation.min_volume_ratio >= kVolumeInQuestion);
}

}  // namespace

Deformation measure_deformation(const TetMesh& mesh, const Points& u) {
  Deformation deformation;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    include(ratio_of(mesh.nodes, mesh.tets.col(t), u), t, deformation);
  }
  deformation.min_nodal_volume_ratio = deformation.min_volume_ratio;
  if (!in_question(deformation)) return deformation;
  VecX rest = VecX::Zero(mesh.nodes.cols()), moved = rest;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const Eigen::Vector4i tet = mesh.tets.col(t);
    add_volume(tet, six_volumes(corners_of(mesh.nodes, tet)), rest);
    add_volume(tet, six_volumes(moved_corners_of(mesh.nodes, tet, u)), moved);
  }
  deformation.min_nodal_volume_ratio = least_ratio(moved, rest);
  return deformation;
}

DeformationCheck::DeformationCheck(const Points& nodes,
                                   const Eigen::Matrix<int, 4, Eigen::Dynamic>& tets,
                                   ThreadTeam& team)
    : team_(team),
      nodes_(nodes),
      tets_(tets),
      centre_(nodes.cols() > 0 ? Vec3(nodes.rowwise().mean()) : Vec3(Vec3::Zero())),
      deformed_(Eigen::Matrix<float, 4, Eigen::Dynamic>::Zero(4, nodes.cols())),
      parts_(static_cast<std::size_t>(team.size())),
      nodal_volume_(VecX::Zero(nodes.cols())),
      moved_nodal_volume_(nodes.cols()) {
  const double extent = nodes.cols() > 0 ? (nodes.colwise() - centre_).cwiseAbs().maxCoeff() : 0.0;
  // Room for a displacement as large as the body.
  const double position_error =
      2.0 * extent * static_cast<double>(std::numeric_limits<float>::epsilon());
  inverse_volume_.reserve(static_cast<std::size_t>(tets.cols()));
  for (Eigen::Index t = 0; t < tets.cols(); ++t) {
    const Corners x = corners_of(nodes, tets.col(t));
    add_volume(tets.col(t), six_volumes(x), nodal_volume_);
    const bool coarse = position_error * sum_inverse_heights(x) < kRatioError;
    inverse_volume_.push_back(coarse ? static_cast<float>(1.0 / six_volumes(x))
                                     : std::numeric_limits<float>::quiet_NaN());
  }
}

double DeformationCheck::exact_ratio(long tet, const Points& u) const {
  return ratio_of(nodes_, tets_.col(tet), u);
}

double DeformationCheck::least_nodal_ratio(const Points& u) {
  moved_nodal_volume_.setZero();
  for (Eigen::Index t = 0; t < tets_.cols(); ++t) {
    const Eigen::Vector4i tet = tets_.col(t);
    add_volume(tet, six_volumes(moved_corners_of(nodes_, tet, u)), moved_nodal_volume_);
  }
  return least_ratio(moved_nodal_volume_, nodal_volume_);
}

void DeformationCheck::measure_part(long begin, long end, const Points& u,
                                    Deformation& part) const {
  float least = std::numeric_limits<float>::infinity();
  long least_tet = -1;
  // Several elements at a time, component by component, so that the compiler can vectorise the
  // loop.
  constexpr int kLanes = 16;
  using Lane = Eigen::Array<float, kLanes, 1>;
  Eigen::Array<float, kLanes, 12> x =
      Eigen::Array<float, kLanes, 12>::Zero();  // corner by corner, x y z
  for (long first = begin; first < end; first += kLanes) {
    const int count = static_cast<int>(std::min<long>(kLanes, end - first));
    for (int lane = 0; lane < count; ++lane) {
      const int* tet = tets_.data() + 4 * (first + lane);
      for (int corner = 0; corner < 4; ++corner) {
        const float* at = deformed_.data() + 4 * static_cast<long>(tet[corner]);
        for (int axis = 0; axis < 3; ++axis) x(lane, 3 * corner + axis) = at[axis];
      }
    }
    const Lane ax = x.col(3) - x.col(0), ay = x.col(4) - x.col(1), az = x.col(5) - x.col(2);
    const Lane bx = x.col(6) - x.col(0), by = x.col(7) - x.col(1), bz = x.col(8) - x.col(2);
    const Lane cx = x.col(9) - x.col(0), cy = x.col(10) - x.col(1), cz = x.col(11) - x.col(2);
    const Lane volume =
        cx * (ay * bz - az * by) + cy * (az * bx - ax * bz) + cz * (ax * by - ay * bx);
    for (int lane = 0; lane < count; ++lane) {
      const long t = first + lane;
      const float ratio = volume[lane] * inverse_volume_[static_cast<std::size_t>(t)];
      if (ratio > kSurelyUpright) {
        if (ratio < least) {
          least = ratio;
          least_tet = t;
        }
      } else {
        include(exact_ratio(t, u), static_cast<int>(t), part);
      }
    }
  }
  if (least_tet >= 0) include(static_cast<double>(least), static_cast<int>(least_tet), part);
}

Deformation DeformationCheck::measure(const Points& u) {
  team_.split(u.cols(), [&](long begin, long end) {
    for (long i = begin; i < end; ++i) {
      deformed_.col(i).head<3>() = (nodes_.col(i) + u.col(i) - centre_).cast<float>();
    }
  });
  auto task = [&](int member) {
    const long count = tets_.cols(), members = team_.size();
    Deformation& part = parts_[static_cast<std::size_t>(member)];
    part = {};
    measure_part(count * member / members, count * (member + 1) / members, u, part);
  };
  team_.run(task);
  Deformation whole;
  for (const Deformation& part : parts_) {
    if (part.worst_tet < 0) continue;
    const int inverted = whole.inverted + part.inverted;
    include(part.min_volume_ratio, part.worst_tet, whole);
    whole.inverted = inverted;
  }
  whole.min_nodal_volume_ratio = in_question(whole) ? least_nodal_ratio(u) : whole.min_volume_ratio;
  return whole;
}

}  // namespace brainshift::fem
