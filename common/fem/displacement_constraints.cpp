// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/fem/displacement_constraints.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

namespace brainshift::fem {
namespace {

// Two directions whose sine is below this count as one, and a normal this close to a coordinate
// axis counts as that axis.
constexpr double kParallel = 1e-6;
constexpr double kAxisAligned = 1e-12;
// Values that differ by less than this do not contradict each other; relative to 1 mm or the
// value.
constexpr double kSameValue = 1e-9;

Vec3 snapped(const Vec3& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  const Vec3 unit = direction[axis] > 0.0 ? Vec3(Vec3::Unit(axis)) : Vec3(-Vec3::Unit(axis));
  return (direction - unit).norm() < kAxisAligned ? unit : direction;
}

bool is_coordinate_axis(const Vec3& v) { return v.cwiseAbs().maxCoeff() == 1.0; }

}  // namespace

DisplacementConstraints::DisplacementConstraints(int num_nodes)
    : of_node_(static_cast<std::size_t>(num_nodes)) {}

Status DisplacementConstraints::add(NodeIndex node, const Vec3& direction, double value,
                                    const std::string& source) {
  assert(std::abs(direction.norm() - 1.0) < 1e-9);
  if (sources_.empty() || sources_.back() != source) sources_.push_back(source);
  const int source_index = static_cast<int>(sources_.size()) - 1;
  auto& known = of_node_[static_cast<std::size_t>(node)];
  Vec3 rest = snapped(direction);
  double rest_value = value;
  double spanned_value = 0.0;
  for (const Direction& other : known) {
    const double along = direction.dot(other.axis);
    rest -= along * other.axis;
    rest_value -= along * other.value;
    spanned_value += along * other.value;
  }
  const double length = rest.norm();
  if (length < kParallel) {
    if (std::abs(spanned_value - value) <= kSameValue * (1.0 + std::abs(value))) return {};
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("{} prescribes {} mm at node {}, but {} prescribes {} mm there", source, value,
                    node, sources_[static_cast<std::size_t>(known.back().source)], spanned_value));
  }
  known.push_back({snapped(rest / length), rest_value / length, source_index});
  return {};
}

Status DisplacementConstraints::add_all(NodeIndex node, const Vec3& value,
                                        const std::string& source) {
  for (int axis = 0; axis < 3; ++axis) {
    if (Status ok = add(node, Vec3::Unit(axis), value[axis], source); !ok) return ok;
  }
  return {};
}

std::vector<Vec3> DisplacementConstraints::directions(NodeIndex node) const {
  std::vector<Vec3> axes;
  for (const Direction& d : of_node_[static_cast<std::size_t>(node)]) axes.push_back(d.axis);
  return axes;
}

ConstrainedDofs DisplacementConstraints::build() const {
  const auto n = static_cast<int>(of_node_.size());
  ConstrainedDofs result{DofMap(n), Points::Zero(3, n)};
  for (int node = 0; node < n; ++node) {
    const auto axes = directions(node);
    if (axes.empty()) continue;
    for (const Direction& d : of_node_[static_cast<std::size_t>(node)]) {
      result.lift.col(node) += d.value * d.axis;
    }
    bool coordinate = true;
    for (const Vec3& axis : axes) coordinate = coordinate && is_coordinate_axis(axis);
    if (axes.size() == 3) {
      result.dofs.fix_all(node);
    } else if (coordinate) {
      for (const Vec3& axis : axes) {
        int component = 0;
        axis.cwiseAbs().maxCoeff(&component);
        result.dofs.fix_component(node, component);
      }
    } else if (axes.size() == 1) {
      result.dofs.fix_normal(node, axes[0]);
    } else {
      result.dofs.fix_plane(node, axes[0], axes[1]);
    }
  }
  result.dofs.finalise();
  return result;
}

}  // namespace brainshift::fem
