// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/prior/force_kernel.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <nanoflann.hpp>
#include <utility>
#include <vector>

#include "common/core/point_columns.hpp"
#include "common/geometry/spread_nodes.hpp"

namespace brainshift::prior {
namespace {

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
  ForceKernel kernel;
  kernel.compact_.resize(nodes.cols(), nodes.cols());
  kernel.compact_.setFromTriplets(entries.begin(), entries.end());
  return kernel;
}

ForceKernel ForceKernel::basis(const Points& nodes, const VecX& nodal_volumes, double length_mm,
                               double force_density_sd) {
  assert(nodal_volumes.size() == nodes.cols());
  const double wanted =
      kCentresPerLength * nodal_volumes.sum() / (length_mm * length_mm * length_mm);
  const int count =
      static_cast<int>(std::clamp(wanted, double{kFewestCentres}, double{kMostCentres}));
  const Points centres = nodes(Eigen::all, geometry::spread_nodes(nodes, count));
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
  among.llt().matrixU().solveInPlace<Eigen::OnTheRight>(kernel.basis_);
  return kernel;
}

void ForceKernel::multiply(const RowMajor& in, RowMajor& out) const {
  if (compact_.rows() > 0) {
    out.noalias() = compact_ * in;
  } else {
    const RowMajor projected = basis_.transpose() * in;
    out.noalias() = basis_ * projected;
  }
}

void ForceKernel::add_to(const Points& w, Points& f) const {
  RowMajor out;
  multiply(w.transpose(), out);
  f += out.transpose();
}

void ForceKernel::apply(const Eigen::MatrixXd& w, Eigen::MatrixXd& f) const {
  const Eigen::Index n = w.rows() / 3;
  f.resize(w.rows(), w.cols());
  // A few fields at a time: stays in cache.
  constexpr Eigen::Index kColumns = 8;
  RowMajor in, out;
  for (Eigen::Index first = 0; first < w.cols(); first += kColumns) {
    const Eigen::Index count = std::min(kColumns, w.cols() - first);
    in.resize(n, 3 * count);
    for (Eigen::Index j = 0; j < count; ++j) {
      in.middleCols<3>(3 * j) = Eigen::Map<const Points>(w.col(first + j).data(), 3, n).transpose();
    }
    multiply(in, out);
    for (Eigen::Index j = 0; j < count; ++j) {
      Eigen::Map<Points>(f.col(first + j).data(), 3, n) = out.middleCols<3>(3 * j).transpose();
    }
  }
}

Eigen::MatrixXd ForceKernel::dense() const {
  if (compact_.rows() > 0) return Eigen::MatrixXd(compact_);
  return basis_ * basis_.transpose();
}

std::uint64_t ForceKernel::bytes() const {
  return static_cast<std::uint64_t>(compact_.nonZeros()) * (sizeof(double) + sizeof(int)) +
         static_cast<std::uint64_t>(basis_.size()) * sizeof(double);
}

}  // namespace brainshift::prior
