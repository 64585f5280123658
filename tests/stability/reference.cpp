// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/reference.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

namespace brainshift::stability {
namespace {

using Strain = Eigen::Matrix<Real, 6, 12>;
using Element = Eigen::Matrix<Real, 12, 12>;

// B^T D B V of one linear tetrahedron, engineering strains xx yy zz xy yz zx.
Element element_stiffness(const TetMesh& mesh, int tet, const fem::Elasticity& material) {
  Eigen::Matrix<Real, 4, 4> corners;
  for (int k = 0; k < 4; ++k) {
    corners(k, 0) = 1;
    corners.row(k).tail<3>() = mesh.nodes.col(mesh.tets(k, tet)).transpose().cast<Real>();
  }
  const Eigen::FullPivLU<Eigen::Matrix<Real, 4, 4>> lu(corners);
  const Eigen::Matrix<Real, 4, 4> coefficients = lu.inverse();  // column k: shape function k
  const Real volume = std::abs(lu.determinant()) / 6;
  Strain b = Strain::Zero();
  for (int k = 0; k < 4; ++k) {
    const Real x = coefficients(1, k), y = coefficients(2, k), z = coefficients(3, k);
    b.block<6, 3>(0, 3 * k) << x, 0, 0, 0, y, 0, 0, 0, z, y, x, 0, 0, z, y, z, 0, x;
  }
  Eigen::Matrix<Real, 6, 6> d = Eigen::Matrix<Real, 6, 6>::Zero();
  d.topLeftCorner<3, 3>().setConstant(static_cast<Real>(material.lambda));
  for (int k = 0; k < 3; ++k) {
    d(k, k) += 2 * static_cast<Real>(material.shear);
    d(3 + k, 3 + k) = static_cast<Real>(material.shear);
  }
  return volume * b.transpose() * d * b;
}

}  // namespace

VectorR Unknowns::restrict_to(const Eigen::Ref<const VectorR>& nodal) const {
  VectorR q(count);
  for (int n = 0; n < num_nodes(); ++n) {
    const auto node = static_cast<std::size_t>(n);
    const Vec3R local = frames[node].transpose() * nodal.segment<3>(3 * n);
    for (int axis = 0; axis < 3; ++axis) {
      const int k = index[node][static_cast<std::size_t>(axis)];
      if (k >= 0) q[k] = local[axis];
    }
  }
  return q;
}

VectorR Unknowns::expand(const Eigen::Ref<const VectorR>& unknowns) const {
  VectorR u(3 * num_nodes());
  for (int n = 0; n < num_nodes(); ++n) {
    const auto node = static_cast<std::size_t>(n);
    Vec3R local = Vec3R::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const int k = index[node][static_cast<std::size_t>(axis)];
      if (k >= 0) local[axis] = unknowns[k];
    }
    u.segment<3>(3 * n) = frames[node] * local;
  }
  return u;
}

Unknowns unknowns_of(const fem::DofMap& dofs) {
  Unknowns unknowns;
  unknowns.count = dofs.num_unknowns();
  for (NodeIndex n = 0; n < dofs.num_nodes(); ++n) {
    unknowns.frames.push_back(dofs.frame(n).cast<Real>());
    unknowns.index.push_back({dofs.unknown(n, 0), dofs.unknown(n, 1), dofs.unknown(n, 2)});
  }
  return unknowns;
}

fem::Elasticity reference_elasticity(double shear_pa, double poisson_ratio) {
  const Real shear = static_cast<Real>(shear_pa) / 1000000, nu = poisson_ratio;
  return {static_cast<double>(2 * shear * nu / (1 - 2 * nu)), static_cast<double>(shear)};
}

MatrixR reference_stiffness(const TetMesh& mesh, const std::vector<fem::Elasticity>& materials,
                            const Unknowns& unknowns) {
  MatrixR full = MatrixR::Zero(unknowns.count, unknowns.count);
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const Element element = element_stiffness(
        mesh, t, materials[materials.size() == 1 ? 0 : static_cast<std::size_t>(t)]);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        const auto row = static_cast<std::size_t>(mesh.tets(i, t));
        const auto column = static_cast<std::size_t>(mesh.tets(j, t));
        const Mat3R block = unknowns.frames[row].transpose() * element.block<3, 3>(3 * i, 3 * j) *
                            unknowns.frames[column];
        for (std::size_t a = 0; a < 3; ++a) {
          for (std::size_t b = 0; b < 3; ++b) {
            const int r = unknowns.index[row][a], c = unknowns.index[column][b];
            if (r < 0 || c < 0) continue;
            full(r, c) += block(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
          }
        }
      }
    }
  }
  return full;
}

linalg::SymmetricMatrix lower_triangle(const MatrixR& full) {
  std::vector<Eigen::Triplet<double, long>> entries;
  for (Eigen::Index j = 0; j < full.cols(); ++j) {
    for (Eigen::Index i = j; i < full.rows(); ++i) {
      if (full(i, j) != 0) entries.emplace_back(i, j, static_cast<double>(full(i, j)));
    }
  }
  linalg::SymmetricMatrix lower(full.rows(), full.cols());
  lower.setFromTriplets(entries.begin(), entries.end());
  return lower;
}

Reference::Reference(MatrixR stiffness, Unknowns unknowns, std::vector<ReferencePair> pairs,
                     Real beta)
    : stiffness_(std::move(stiffness)),
      unknowns_(std::move(unknowns)),
      pairs_(std::move(pairs)),
      beta_(beta),
      active_(pairs_.size(), 0),
      free_(stiffness_),
      matrix_(stiffness_) {}

bool Reference::any_active() const {
  return std::any_of(active_.begin(), active_.end(), [](char a) { return a != 0; });
}

bool Reference::activate(const contact::ActiveSet& active) {
  active_ = active;
  matrix_ = stiffness_;
  if (!any_active()) return free_.info() == Eigen::Success;
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (!active[i]) continue;
    const Vec3R& n = pairs_[i].normal;
    // Slaves are free and have the identity frame.
    const int first = unknowns_.index[static_cast<std::size_t>(pairs_[i].slave)][0];
    matrix_.block<3, 3>(first, first) += beta_ * n * n.transpose();
  }
  factor_.compute(matrix_);
  return factor_.info() == Eigen::Success;
}

MatrixR Reference::solve(const MatrixR& rhs) const {
  return any_active() ? MatrixR(factor_.solve(rhs)) : MatrixR(free_.solve(rhs));
}

void Reference::add_gaps(VectorR& nodal) const {
  for (std::size_t i = 0; i < active_.size(); ++i) {
    if (!active_[i]) continue;
    nodal.segment<3>(3 * pairs_[i].slave) +=
        beta_ * pairs_[i].initial_penetration_mm * pairs_[i].normal;
  }
}

VectorR Reference::displacement(const Points& load) const {
  VectorR nodal = Eigen::Map<const VecX>(load.data(), load.size()).cast<Real>();
  add_gaps(nodal);
  return unknowns_.expand(solve(unknowns_.restrict_to(nodal)).col(0));
}

VectorR Reference::penetration(const VectorR& u) const {
  VectorR p(num_slaves());
  for (int i = 0; i < num_slaves(); ++i) {
    const ReferencePair& pair = pairs_[static_cast<std::size_t>(i)];
    p[i] = pair.initial_penetration_mm - pair.normal.dot(u.segment<3>(3 * pair.slave));
  }
  return p;
}

bool Reference::solve_contact(const Points& load, VectorR& u) {
  contact::ActiveSet set(active_.size(), 0);
  for (int iteration = 0; iteration < 40; ++iteration) {
    if (!activate(set)) return false;
    u = displacement(load);
    const VectorR p = penetration(u);
    contact::ActiveSet next(set.size());
    for (std::size_t i = 0; i < set.size(); ++i) next[i] = p[static_cast<Eigen::Index>(i)] > 0;
    if (next == set) return true;
    set = std::move(next);
  }
  return false;
}

double Reference::condition() const {
  const Eigen::MatrixXd matrix = matrix_.cast<double>();
  VecX top = VecX::LinSpaced(matrix.rows(), 1.0, 2.0).normalized();
  MatrixR bottom = top.cast<Real>();
  double largest = 0.0, smallest = 0.0;
  for (int i = 0; i < 40; ++i) {
    top = matrix * top;
    largest = top.norm();
    top /= largest;
    if (i % 2 == 1) continue;  // inverse iteration converges faster
    bottom = solve(bottom);
    smallest = static_cast<double>(1 / bottom.norm());
    bottom /= bottom.norm();
  }
  return largest / smallest;
}

double relative_difference(const Points& u, const VectorR& v) {
  const VectorR flat = Eigen::Map<const VecX>(u.data(), u.size()).cast<Real>();
  return static_cast<double>((flat - v).norm() / v.norm());
}

double greatest_difference(const Points& u, const VectorR& v) {
  double worst = 0.0;
  for (Eigen::Index i = 0; i < u.cols(); ++i) {
    const Vec3R apart = u.col(i).cast<Real>() - v.segment<3>(3 * i);
    worst = std::max(worst, static_cast<double>(apart.norm()));
    if (!std::isfinite(worst) || !u.col(i).allFinite()) return std::nan("");
  }
  return worst;
}

}  // namespace brainshift::stability
