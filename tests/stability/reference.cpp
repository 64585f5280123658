// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/stability/reference.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/fem/sampling.hpp"
#include "common/inversion/contract/data_check.hpp"
#include "common/prior/load_modes.hpp"

namespace brainshift::stability {
namespace {

using Vec3R = Eigen::Matrix<Real, 3, 1>;
using Mat3R = Eigen::Matrix<Real, 3, 3>;
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

MatrixR reference_stiffness(const TetMesh& mesh, const std::vector<fem::Elasticity>& materials,
                            const fem::DofMap& dofs) {
  MatrixR full = MatrixR::Zero(dofs.num_unknowns(), dofs.num_unknowns());
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const Element element = element_stiffness(
        mesh, t, materials[materials.size() == 1 ? 0 : static_cast<std::size_t>(t)]);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        const NodeIndex row = mesh.tets(i, t), column = mesh.tets(j, t);
        const Mat3R block = dofs.frame(row).cast<Real>().transpose() *
                            element.block<3, 3>(3 * i, 3 * j) * dofs.frame(column).cast<Real>();
        for (int a = 0; a < 3; ++a) {
          for (int b = 0; b < 3; ++b) {
            const int r = dofs.unknown(row, a), c = dofs.unknown(column, b);
            if (r >= 0 && c >= 0) full(r, c) += block(a, b);
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

VectorR restrict_to(const fem::DofMap& dofs, const Eigen::Ref<const MatrixR>& nodal) {
  VectorR q(dofs.num_unknowns());
  for (int n = 0; n < dofs.num_nodes(); ++n) {
    const Vec3R local = dofs.frame(n).cast<Real>().transpose() * nodal.col(0).segment<3>(3 * n);
    for (int axis = 0; axis < 3; ++axis) {
      if (dofs.unknown(n, axis) >= 0) q[dofs.unknown(n, axis)] = local[axis];
    }
  }
  return q;
}

VectorR expand(const fem::DofMap& dofs, const VectorR& unknowns) {
  VectorR u(3 * dofs.num_nodes());
  for (int n = 0; n < dofs.num_nodes(); ++n) {
    Vec3R local = Vec3R::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      if (dofs.unknown(n, axis) >= 0) local[axis] = unknowns[dofs.unknown(n, axis)];
    }
    u.segment<3>(3 * n) = dofs.frame(n).cast<Real>() * local;
  }
  return u;
}

Reference::Reference(MatrixR stiffness, const fem::DofMap& dofs,
                     const contact::PenaltyContact* contact)
    : stiffness_(std::move(stiffness)), dofs_(dofs), contact_(contact) {
  activate(contact::ActiveSet(
      contact == nullptr ? 0 : static_cast<std::size_t>(contact->num_slaves()), 0));
}

bool Reference::activate(const contact::ActiveSet& active) {
  active_ = active;
  matrix_ = stiffness_;
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (!active[i]) continue;
    const contact::ContactPair& pair = contact_->pairs()[i];
    const Vec3R n = pair.normal.cast<Real>();
    const int first = dofs_.unknown(pair.slave, 0);  // slaves have the identity frame
    matrix_.block<3, 3>(first, first) += static_cast<Real>(contact_->beta()) * n * n.transpose();
  }
  factor_.compute(matrix_);
  return factor_.info() == Eigen::Success;
}

VectorR Reference::displacement(const Points& load) const {
  VectorR nodal = Eigen::Map<const VecX>(load.data(), load.size()).cast<Real>();
  for (std::size_t i = 0; i < active_.size(); ++i) {
    if (!active_[i]) continue;
    const contact::ContactPair& pair = contact_->pairs()[i];
    nodal.segment<3>(3 * pair.slave) += static_cast<Real>(contact_->beta()) *
                                        static_cast<Real>(pair.initial_penetration_mm) *
                                        pair.normal.cast<Real>();
  }
  return expand(dofs_, solve(restrict_to(dofs_, nodal)));
}

VectorR Reference::penetration(const VectorR& u) const {
  VectorR p(static_cast<Eigen::Index>(active_.size()));
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const contact::ContactPair& pair = contact_->pairs()[i];
    p[static_cast<Eigen::Index>(i)] = static_cast<Real>(pair.initial_penetration_mm) -
                                      pair.normal.cast<Real>().dot(u.segment<3>(3 * pair.slave));
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
  VectorR bottom = top.cast<Real>();
  double largest = 0.0, smallest = 0.0;
  for (int i = 0; i < 40; ++i) {
    top = matrix * top;
    largest = top.norm();
    top /= largest;
    if (i % 2 == 1) continue;  // inverse iteration converges faster
    bottom = factor_.solve(bottom);
    smallest = static_cast<double>(1 / bottom.norm());
    bottom.normalize();
  }
  return largest / smallest;
}

bool reference_posterior(Reference& reference, const inversion::PreparedModel& model,
                         const SparseData& data, const Estimate& estimate,
                         PosteriorReference& result) {
  const std::vector<NodeIndex>& active_nodes = estimate.active_slaves;
  const contact::PenaltyContact& contact = model.forward().contact();
  const fem::DofMap& dofs = model.forward().dofs();
  const int n = model.model().mesh.num_nodes();
  contact::ActiveSet active(static_cast<std::size_t>(contact.num_slaves()), 0);
  for (std::size_t i = 0; i < active.size(); ++i) {
    active[i] = std::count(active_nodes.begin(), active_nodes.end(), contact.pairs()[i].slave) > 0;
  }
  if (!reference.activate(active)) return false;
  const auto weights =
      fem::sampling_matrix(model.locator(), n, data.positions, inversion::kOutsideTolerance_mm);
  if (!weights) return false;
  const Eigen::Index m = data.size();
  MatrixR loads(dofs.num_unknowns(), 3 * m);  // T^T A^T
  for (Eigen::Index i = 0; i < m; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      MatrixR column = MatrixR::Zero(3 * n, 1);
      for (fem::SamplingMatrix::InnerIterator it(*weights, i); it; ++it) {
        column(3 * it.col() + axis, 0) = static_cast<Real>(it.value());
      }
      loads.col(3 * i + axis) = restrict_to(dofs, column);
    }
  }
  const MatrixR adjoints = reference.solve(loads);  // K_p^-1 T^T A^T
  const auto& scales = estimate.prior_scales;
  MatrixR kernel = Eigen::MatrixXd(model.prior().kernel()).cast<Real>();
  const auto other = static_cast<Real>(scales[static_cast<std::size_t>(PriorPart::kOther)]);
  kernel *= other * other;
  MatrixR modes = model.prior().modes().cast<Real>();
  for (Eigen::Index j = 0; j < modes.cols(); ++j) {
    const PriorPart part = prior::prior_part(static_cast<int>(j),
                                                 prior::load_mode_counts(model.config().prior));
    modes.col(j) *= static_cast<Real>(scales[static_cast<std::size_t>(part)]);
  }
  MatrixR forces(dofs.num_unknowns(), 3 * m);  // T^T Sigma T K_p^-1 T^T A^T
  for (Eigen::Index j = 0; j < 3 * m; ++j) {
    const VectorR nodal = expand(dofs, adjoints.col(j));
    const Eigen::Map<const Eigen::Matrix<Real, 3, Eigen::Dynamic>> w(nodal.data(), 3, n);
    const Eigen::Matrix<Real, 3, Eigen::Dynamic> f = w * kernel;  // symmetric
    MatrixR force = Eigen::Map<const VectorR>(f.data(), f.size());
    if (modes.cols() > 0) force += modes * (modes.transpose() * nodal);
    forces.col(j) = restrict_to(dofs, force);
  }
  MatrixR innovation = adjoints.transpose() * forces;
  for (Eigen::Index i = 0; i < 3 * m; ++i) {
    const Real sd = static_cast<Real>(data.sd_mm[i / 3]);
    innovation(i, i) += sd * sd;
  }
  const VectorR shift = reference.displacement(Points::Zero(3, n));
  VectorR misfit = Eigen::Map<const VecX>(data.displacements.data(), 3 * m).cast<Real>();
  for (Eigen::Index i = 0; i < m; ++i) {
    for (fem::SamplingMatrix::InnerIterator it(*weights, i); it; ++it) {
      misfit.segment<3>(3 * i) -= static_cast<Real>(it.value()) * shift.segment<3>(3 * it.col());
    }
  }
  const Eigen::LLT<MatrixR> factor(innovation);
  if (factor.info() != Eigen::Success) return false;
  const VectorR mu = factor.solve(misfit);
  const VectorR load = forces * mu;
  result.displacement = shift + expand(dofs, reference.solve(load));
  result.penetration = reference.penetration(result.displacement);
  return true;
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
