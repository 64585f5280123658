// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/prior/force_prior.hpp"

#include <cassert>
#include <cmath>
#include <nanoflann.hpp>
#include <utility>
#include <vector>

#include "common/core/point_columns.hpp"

namespace brainshift::prior {
namespace {

using KdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointColumns>,
                                        PointColumns, 3, std::size_t>;

}  // namespace

double wendland_c2(double r, double support) {
  const double t = r / support;
  if (t >= 1.0) return 0.0;
  const double u = 1.0 - t;
  return u * u * u * u * (4.0 * t + 1.0);
}

ForcePrior::ForcePrior(const Points& nodes, const VecX& nodal_volumes, double correlation_length_mm,
                       double force_density_sd, Eigen::MatrixXd modes)
    : kernel_(nodes.cols(), nodes.cols()), modes_(std::move(modes)) {
  assert(nodal_volumes.size() == nodes.cols());
  assert(modes_.size() == 0 || modes_.rows() == 3 * nodes.cols());
  const double support = kSupportOverCorrelationLength * correlation_length_mm;
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
  kernel_.setFromTriplets(entries.begin(), entries.end());
}

void ForcePrior::apply(const Points& w, Points& f) const {
  f.noalias() = (kernel_ * w.transpose()).transpose();
  if (modes_.cols() == 0) return;
  const Eigen::Map<const VecX> w_flat(w.data(), w.size());
  Eigen::Map<VecX> f_flat(f.data(), f.size());
  f_flat.noalias() += modes_ * (modes_.transpose() * w_flat);
}

void ForcePrior::apply_kernel(const Eigen::MatrixXd& w, Eigen::MatrixXd& f) const {
  assert(w.rows() == 3 * kernel_.rows());
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Index n = kernel_.rows();
  f.resize(w.rows(), w.cols());
  // A few columns at a time, one row of three components per node and column: stays in cache.
  constexpr Eigen::Index kColumns = 8;
  RowMajor in, out;
  for (Eigen::Index first = 0; first < w.cols(); first += kColumns) {
    const Eigen::Index count = std::min(kColumns, w.cols() - first);
    in.resize(n, 3 * count);
    for (Eigen::Index j = 0; j < count; ++j) {
      in.middleCols<3>(3 * j) = Eigen::Map<const Points>(w.col(first + j).data(), 3, n).transpose();
    }
    out.noalias() = kernel_ * in;
    for (Eigen::Index j = 0; j < count; ++j) {
      Eigen::Map<Points>(f.col(first + j).data(), 3, n) = out.middleCols<3>(3 * j).transpose();
    }
  }
}

Points ForcePrior::apply(const Points& w) const {
  Points f;
  apply(w, f);
  return f;
}

std::uint64_t ForcePrior::bytes() const {
  return static_cast<std::uint64_t>(kernel_.nonZeros()) * (sizeof(double) + sizeof(int)) +
         static_cast<std::uint64_t>(modes_.size()) * sizeof(double);
}

}  // namespace brainshift::prior
