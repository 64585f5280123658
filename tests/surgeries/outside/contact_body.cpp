// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/outside/contact_body.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "common/fem/elasticity.hpp"

namespace brainshift::outside {
namespace {

constexpr int kSettling = 30, kMaxSets = 300;
constexpr std::size_t kBlock = 64;
// Below this a side neither presses nor penetrates: rounding decides.
constexpr double kRounding_mm = 1e-9, kRounding_n = 1e-12;

}  // namespace

ContactBody::ContactBody(const fem::DisplacementSpace& space, const fem::MaterialMap& materials,
                         Supports supports, linalg::SparseCholesky factor)
    : space_(&space),
      materials_(materials),
      supports_(std::move(supports)),
      factor_(std::move(factor)) {
  for (const Side& side : supports_.sides) {
    std::vector<Entry> entries;
    for (int axis = 0; axis < 3; ++axis) {
      const int unknown = supports_.dofs.unknown(side.node, axis);
      const double value = supports_.dofs.frame(side.node).col(axis).dot(side.normal);
      if (unknown >= 0) entries.push_back({unknown, value});
    }
    normals_.push_back(std::move(entries));
  }
  phi_.resize(normals_.size());
  active_.assign(normals_.size(), 0);
}

Result<ContactBody> ContactBody::make(const fem::DisplacementSpace& space,
                                      const fem::MaterialMap& materials, Supports supports) {
  linalg::SymmetricMatrix k = fem::assemble_stiffness(space, materials, supports.dofs);
  for (const Spring& spring : supports.springs) {
    fem::add_block(k, supports.dofs, spring.node, spring.node, spring.stiffness);
  }
  auto factor = linalg::SparseCholesky::factorise(k);
  if (!factor) return tl::unexpected(factor.error());
  return ContactBody(space, materials, std::move(supports), std::move(*factor));
}

VecX ContactBody::gaps() const {
  VecX gaps(static_cast<Eigen::Index>(supports_.sides.size()));
  for (Eigen::Index i = 0; i < gaps.size(); ++i) {
    gaps[i] = supports_.sides[static_cast<std::size_t>(i)].gap_mm;
  }
  return gaps;
}

VecX ContactBody::outward(const Points& u) const {
  VecX along(static_cast<Eigen::Index>(supports_.sides.size()));
  for (Eigen::Index i = 0; i < along.size(); ++i) {
    const Side& side = supports_.sides[static_cast<std::size_t>(i)];
    along[i] = side.normal.dot(u.col(side.node));
  }
  return along;
}

Points ContactBody::push(const VecX& pressing) const {
  Points force = Points::Zero(3, space_->num_nodes());
  for (Eigen::Index i = 0; i < pressing.size(); ++i) {
    const Side& side = supports_.sides[static_cast<std::size_t>(i)];
    force.col(side.node) -= pressing[i] * side.normal;
  }
  return force;
}

Points ContactBody::internal_force(const Points& u) const {
  Points force = fem::internal_force(*space_, materials_, u);
  for (const Spring& spring : supports_.springs) {
    force.col(spring.node) += spring.stiffness * u.col(spring.node);
  }
  return force;
}

VecX ContactBody::outward_of(const VecX& q) const {
  VecX along(static_cast<Eigen::Index>(normals_.size()));
  for (std::size_t i = 0; i < normals_.size(); ++i) {
    double sum = 0.0;
    for (const Entry& entry : normals_[i]) sum += entry.value * q[entry.unknown];
    along[static_cast<Eigen::Index>(i)] = sum;
  }
  return along;
}

void ContactBody::know(const std::vector<int>& sides) {
  std::vector<int> wanted;
  for (const int i : sides) {
    if (phi_[static_cast<std::size_t>(i)].size() == 0) wanted.push_back(i);
  }
  for (std::size_t begin = 0; begin < wanted.size(); begin += kBlock) {
    const std::size_t count = std::min(kBlock, wanted.size() - begin);
    Eigen::MatrixXd forces =
        Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(count), supports_.dofs.num_unknowns());
    for (std::size_t k = 0; k < count; ++k) {
      for (const Entry& entry : normals_[static_cast<std::size_t>(wanted[begin + k])]) {
        forces(static_cast<Eigen::Index>(k), entry.unknown) = entry.value;
      }
    }
    const Eigen::MatrixXd answers = factor_.solve_rows(forces);
    for (std::size_t k = 0; k < count; ++k) {
      phi_[static_cast<std::size_t>(wanted[begin + k])] =
          outward_of(answers.row(static_cast<Eigen::Index>(k)).transpose());
    }
  }
}

Result<Equilibrium> ContactBody::solve(const Points& load, const VecX& gaps) {
  const VecX b = supports_.dofs.restrict_to(load);
  const VecX free = outward_of(factor_.solve(b)) - gaps;  // -inf where there is no wall
  const Eigen::Index count = free.size();
  Equilibrium result;
  result.pressing_n = VecX::Zero(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    if (gaps[i] == kNoWall) active_[static_cast<std::size_t>(i)] = 0;
  }
  for (result.sets = 1; result.sets <= kMaxSets; ++result.sets) {
    std::vector<int> set;
    for (int i = 0; i < static_cast<int>(count); ++i) {
      if (active_[static_cast<std::size_t>(i)] != 0) set.push_back(i);
    }
    know(set);
    const auto size = static_cast<Eigen::Index>(set.size());
    Eigen::MatrixXd phi(size, size);
    for (Eigen::Index j = 0; j < size; ++j) {
      phi.col(j) = phi_[static_cast<std::size_t>(set[static_cast<std::size_t>(j)])](set);
    }
    const VecX lambda = size > 0 ? VecX(phi.llt().solve(free(set))) : VecX(0);
    VecX depth = free;
    for (Eigen::Index j = 0; j < size; ++j) {
      depth -= lambda[j] * phi_[static_cast<std::size_t>(set[static_cast<std::size_t>(j)])];
    }
    std::vector<int> wrong;
    int worst = -1;
    double most = 0.0;  // in units of motion: a pull would move its side by so much
    const auto doubt = [&](int side, double by) {
      wrong.push_back(side);
      if (by > most) worst = side, most = by;
    };
    for (Eigen::Index j = 0; j < size; ++j) {
      if (lambda[j] < -kRounding_n) doubt(set[static_cast<std::size_t>(j)], -lambda[j] * phi(j, j));
    }
    for (int i = 0; i < static_cast<int>(count); ++i) {
      if (active_[static_cast<std::size_t>(i)] == 0 && depth[i] > kRounding_mm) doubt(i, depth[i]);
    }
    if (wrong.empty()) {
      for (Eigen::Index j = 0; j < size; ++j) {
        result.pressing_n[set[static_cast<std::size_t>(j)]] = std::max(0.0, lambda[j]);
      }
      const VecX q = factor_.solve(b + supports_.dofs.restrict_to(push(result.pressing_n)));
      result.displacement = supports_.dofs.expand(q);
      if (!result.displacement.allFinite()) {
        return fail(ErrorCode::kNotFinite, "the displacement of a truth is not finite");
      }
      return result;
    }
    if (result.sets > kSettling) wrong = {worst};
    for (const int i : wrong) active_[static_cast<std::size_t>(i)] ^= 1;
  }
  return fail(ErrorCode::kNotConverged,
              "the contact of a truth from outside did not settle after " +
                  std::to_string(kMaxSets) + " sets");
}

}  // namespace brainshift::outside
