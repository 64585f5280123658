// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/prior/force_prior.hpp"

#include <nanoflann.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

#include "common/core/point_columns.hpp"
#include "common/geometry/node_choice.hpp"
#include "common/linalg/blas.hpp"

namespace brainshift::prior {
namespace {

namespace blas = linalg::blas;

using Transposed = Eigen::Map<Eigen::MatrixXd>;
using KdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointColumns>,
                                        PointColumns, 3, std::size_t>;

// Keeps k_cc positive definite in spite of rounding.
constexpr double kJitter = 1e-8;

double papers_correlation(double r, double length) {
  return (1.0 + r / length) * std::exp(-r / length);
}

}  // namespace

double wendland_c2(double r, double support) {
  const double t = r / support;
  if (t >= 1.0) return 0.0;
  const double u = 1.0 - t;
  return u * u * u * u * (4.0 * t + 1.0);
}

ForceKernel ForceKernel::compact(const Points& nodes, const VecX& nodal_volumes, double length_mm,
                                 double force_density_sd) {
  assert(nodal_volumes.size() == nodes.cols());
  ForceKernel kernel;
  kernel.compact_.resize(nodes.cols(), nodes.cols());
  if (force_density_sd == 0.0) return kernel;
  const double support = kSupportOverLength * length_mm;
  const PointColumns cloud{nodes};
  KdTree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  tree.buildIndex();

  std::vector<Eigen::Triplet<double>> entries;
  std::vector<std::pair<std::size_t, double>> matches;
  nanoflann::SearchParams sorted_off;
  sorted_off.sorted = false;
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    tree.radiusSearch(nodes.col(i).data(), support * support, matches, sorted_off);
    for (const auto& [j, distance_squared] : matches) {
      const double value = force_density_sd * force_density_sd * nodal_volumes[i] *
                           nodal_volumes[static_cast<Eigen::Index>(j)] *
                           wendland_c2(std::sqrt(distance_squared), support);
      if (value != 0.0) entries.emplace_back(static_cast<int>(i), static_cast<int>(j), value);
    }
  }
  kernel.compact_.setFromTriplets(entries.begin(), entries.end());
  return kernel;
}

namespace {

// So many as the length asks for, spread over the mesh.
std::vector<NodeIndex> centres_of(const Points& nodes, const VecX& nodal_volumes,
                                  double length_mm) {
  const double wanted =
      ForceKernel::kCentresPerLength * nodal_volumes.sum() / (length_mm * length_mm * length_mm);
  return geometry::spread_nodes(
      nodes, static_cast<int>(std::clamp(wanted, double{ForceKernel::kFewestCentres},
                                         double{ForceKernel::kMaxCentres})));
}

}  // namespace

ForceKernel ForceKernel::of_centres(const Points& nodes, const VecX& nodal_volumes,
                                    double length_mm, double force_density_sd,
                                    const Points& centres) {
  assert(nodal_volumes.size() == nodes.cols());
  const Eigen::Index m = centres.cols();
  Eigen::MatrixXd among(m, m);
  for (Eigen::Index j = 0; j < m; ++j) {
    for (Eigen::Index i = 0; i < m; ++i) {
      among(i, j) = papers_correlation((centres.col(i) - centres.col(j)).norm(), length_mm);
    }
    among(j, j) += kJitter;
  }
  ForceKernel kernel;
  kernel.basis_.resize(nodes.cols(), m);
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      kernel.basis_(i, j) = force_density_sd * nodal_volumes[i] *
                            papers_correlation((nodes.col(i) - centres.col(j)).norm(), length_mm);
    }
  }
  [[maybe_unused]] const bool definite = blas::cholesky(among);
  assert(definite);
  blas::solve_lower(among, Transposed(kernel.basis_.data(), m, nodes.cols()));
  return kernel;
}

ForceKernel ForceKernel::basis(const Points& nodes, const VecX& nodal_volumes, double length_mm,
                               double force_density_sd) {
  const Points centres = nodes(Eigen::all, centres_of(nodes, nodal_volumes, length_mm));
  return of_centres(nodes, nodal_volumes, length_mm, force_density_sd, centres);
}

// By Cholesky factorisation the first columns of the basis are what the first centres explain.
ForceKernel::NearAndFar ForceKernel::basis_about(const Points& nodes, const VecX& nodal_volumes,
                                                 double length_mm, double force_density_sd,
                                                 const std::vector<NodeIndex>& places,
                                                 double near_mm) {
  std::vector<NodeIndex> centres = centres_of(nodes, nodal_volumes, length_mm);
  const Points about = nodes(Eigen::all, places);
  const auto far = std::stable_partition(centres.begin(), centres.end(), [&](NodeIndex centre) {
    return about.cols() > 0 &&
           (about.colwise() - nodes.col(centre)).colwise().squaredNorm().minCoeff() <
               near_mm * near_mm;
  });
  const auto first = far - centres.begin();
  const ForceKernel all =
      of_centres(nodes, nodal_volumes, length_mm, force_density_sd, nodes(Eigen::all, centres));
  NearAndFar parts;
  parts.near.basis_ = all.basis_.leftCols(first);
  parts.far.basis_ = all.basis_.rightCols(all.basis_.cols() - first);
  return parts;
}

ForceKernel ForceKernel::sum_of(const ForceKernel& a, const ForceKernel& b) {
  assert(a.basis_.rows() == b.basis_.rows());
  ForceKernel sum;
  sum.basis_.resize(a.basis_.rows(), a.basis_.cols() + b.basis_.cols());
  sum.basis_ << a.basis_, b.basis_;
  return sum;
}

void ForceKernel::multiply(const Fields& in, Eigen::Map<RowMajor> out) const {
  if (compact_.rows() > 0) {
    out.noalias() = compact_ * in;
    return;
  }
  if (basis_.size() == 0) {
    out.setZero();
    return;
  }
  const Eigen::Map<const Eigen::MatrixXd> basis(basis_.data(), basis_.cols(), basis_.rows());
  blas::multiply(1.0, project(in), basis, 0.0, Transposed(out.data(), in.cols(), in.rows()));
}

// BLAS wants columns: all is transposed.
Eigen::MatrixXd ForceKernel::project(const Fields& in) const {
  const Eigen::Map<const Eigen::MatrixXd> basis(basis_.data(), basis_.cols(), basis_.rows());
  const Eigen::Map<const Eigen::MatrixXd> given(in.data(), in.cols(), in.rows());
  Eigen::MatrixXd projected(in.cols(), basis_.cols());
  blas::multiply_by_transposed(1.0, given, basis, 0.0, projected);
  return projected;
}

void ForceKernel::add_to(const Points& w, Points& f) const {
  Points out(3, w.cols());
  multiply(Fields(w.data(), w.cols(), 3), {out.data(), w.cols(), 3});
  f += out;
}

// k x 3n, columns of a node one after the other, is n x 3k by rows: component a of field j is
// column a k + j.
void ForceKernel::apply(const Eigen::MatrixXd& w, Eigen::MatrixXd& f) const {
  f.resize(w.rows(), w.cols());
  assert(f.data() != w.data());
  multiply(Fields(w.data(), w.cols() / 3, 3 * w.rows()), {f.data(), w.cols() / 3, 3 * w.rows()});
}

VecX ForceKernel::variance_along(const Eigen::MatrixXd& w) const {
  const Fields fields(w.data(), w.cols() / 3, 3 * w.rows());
  VecX each;
  if (compact_.rows() > 0) {
    RowMajor forces(fields.rows(), fields.cols());
    multiply(fields, {forces.data(), forces.rows(), forces.cols()});
    each = fields.cwiseProduct(forces).colwise().sum();
  } else if (basis_.size() == 0) {
    each = VecX::Zero(fields.cols());
  } else {
    each = project(fields).rowwise().squaredNorm();
  }
  return each.reshaped(w.rows(), 3).rowwise().sum();
}

std::uint64_t ForceKernel::bytes() const {
  return static_cast<std::uint64_t>(compact_.nonZeros()) * (sizeof(double) + sizeof(int)) +
         static_cast<std::uint64_t>(basis_.size()) * sizeof(double);
}

ForcePrior::ForcePrior(std::array<ForceKernel, kRemainders> kernels, LoadModes modes)
    : kernels_(std::move(kernels)), modes_(std::move(modes)) {}

void ForcePrior::apply(const Points& w, Points& f) const {
  f.setZero(3, w.cols());
  for (const ForceKernel& kernel : kernels_) kernel.add_to(w, f);
  if (num_modes() == 0) return;
  const Eigen::Map<const VecX> w_flat(w.data(), w.size());
  Eigen::Map<VecX> f_flat(f.data(), f.size());
  f_flat.noalias() += modes() * (modes().transpose() * w_flat);
}

Points ForcePrior::apply(const Points& w) const {
  Points f;
  apply(w, f);
  return f;
}

std::uint64_t ForcePrior::bytes() const {
  std::uint64_t sum = static_cast<std::uint64_t>(modes().size()) * sizeof(double);
  for (const ForceKernel& kernel : kernels_) sum += kernel.bytes();
  return sum;
}

}  // namespace brainshift::prior
