// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/outside/cavity.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

namespace brainshift::outside {
namespace {

// Of a face's nodes: vertices 0 to 2, then the middles of 01, 12 and 20.
constexpr std::array<std::array<int, 3>, 4> kQuarters = {
    {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}};

double depth(double x, const CavityPart& part) {
  const double from_middle = x - part.middle_x;
  return part.sign == 0.0 ? from_middle : part.sign * std::max(part.sign * from_middle, 0.0);
}

// int f n_x dA over a flat triangle.
double outflow(const Mat3& corners, const CavityPart& part) {
  const Vec3 area =
      0.5 * Vec3(corners.col(1) - corners.col(0)).cross(Vec3(corners.col(2) - corners.col(0)));
  double mean = 0.0;
  for (int k = 0; k < 3; ++k) mean += depth(corners(0, k), part) / 3.0;
  return mean * area[0];
}

}  // namespace

double cavity_volume(const fem::DisplacementSpace& space, const Points& u, const Wall& wall,
                     const CavityPart& part) {
  double volume = 0.0;
  const auto add = [&](int a, int b, int c) {
    Mat3 corners;
    corners << space.nodes.col(a) + u.col(a), space.nodes.col(b) + u.col(b),
        space.nodes.col(c) + u.col(c);
    volume -= outflow(corners, part);  // the wall looks into the cavity
  };
  for (const auto& face : wall.colwise()) {
    const auto nodes = fem::face_nodes(space, face);
    if (space.nodes_per_face() == 3) {
      add(nodes[0], nodes[1], nodes[2]);
      continue;
    }
    for (const auto& [a, b, c] : kQuarters) {
      add(nodes[static_cast<std::size_t>(a)], nodes[static_cast<std::size_t>(b)],
          nodes[static_cast<std::size_t>(c)]);
    }
  }
  return volume;
}

double cavity_loss(const fem::DisplacementSpace& space, const Points& u, const Wall& wall,
                   const CavityPart& part) {
  const double before = cavity_volume(space, Points::Zero(3, space.num_nodes()), wall, part);
  return before > 0.0 ? 1.0 - cavity_volume(space, u, wall, part) / before : 0.0;
}

Points suction_load(const fem::DisplacementSpace& space, const Wall& wall, const CavityPart& part,
                    double suction) {
  std::vector<Eigen::Index> drained;
  for (Eigen::Index f = 0; f < wall.cols(); ++f) {
    const double x = space.nodes(0, wall.col(f)).mean();
    if (part.sign == 0.0 || part.sign * (x - part.middle_x) > 0.0) drained.push_back(f);
  }
  return fem::pressure_load(space, wall(Eigen::all, drained), -suction);
}

}  // namespace brainshift::outside
