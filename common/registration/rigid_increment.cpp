// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/rigid_increment.hpp"

namespace brainshift::registration {

RigidTransform rigid_increment(const Vec6& xi, const Vec3& centre) {
  const Vec3 w = xi.head<3>();
  const double angle = w.norm();
  RigidTransform increment = RigidTransform::Identity();
  if (angle > 0.0) increment.linear() = Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
  increment.translation() = centre - increment.linear() * centre + xi.tail<3>();
  return increment;
}

Vec3 rotation_vector(const Mat3& rotation) {
  const Eigen::AngleAxisd angle_axis(rotation);
  return angle_axis.angle() * angle_axis.axis();
}

Vec6 direction_gradient(const Vec3& x, const Vec3& n, const Vec3& centre) {
  Vec6 gradient;
  gradient << (x - centre).cross(n), n;
  return gradient;
}

}  // namespace brainshift::registration
