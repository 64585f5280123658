// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/condensed_exact.hpp"

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "common/contact/set_search.hpp"
#include "common/core/statistics.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/condensed/find_contact_set.hpp"
#include "common/inversion/contract/data_check.hpp"
#include "common/inversion/contract/estimate_check.hpp"
#include "common/inversion/contract/penetration.hpp"
#include "common/inversion/prepared/output_operators.hpp"
#include "common/linalg/blas.hpp"

namespace brainshift::inversion {
namespace {

namespace blas = linalg::blas;
using Eigen::MatrixXd;

// The location of a datum on a face or at a node has barycentric weights of rounding size, 1e-16
// times a mesh of some hundred elements across. Less than this is 0.
constexpr double kLeastBarycentric = 1e-12;

// A over the rows of the data region.
struct RegionSampling {
  Eigen::Matrix<int, 4, Eigen::Dynamic> nodes;       // 4 x m, place in the region
  Eigen::Matrix<double, 4, Eigen::Dynamic> weights;  // 4 x m

  // out = A array; array has the region's rows first.
  MatrixXd times(const Eigen::Ref<const MatrixXd>& array) const {
    MatrixXd out = MatrixXd::Zero(3 * nodes.cols(), array.cols());
    for (Eigen::Index j = 0; j < array.cols(); ++j) {
      for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
        for (int k = 0; k < 4; ++k) {
          out.col(j).segment<3>(3 * i) += weights(k, i) * array.col(j).segment<3>(3 * nodes(k, i));
        }
      }
    }
    return out;
  }
};

}  // namespace

struct CondensedExact::Impl {
  Impl(const PreparedModel& given, const CondensedExactOptions& given_options,
       OutputOperators given_outputs)
      : model(given),
        options(given_options),
        outputs(std::move(given_outputs)),
        slaves(model.forward().contact().num_slaves()),
        beta(model.forward().contact().beta()),
        initial_penetration(slaves),
        diagonal(outputs.compliance.diagonal().tail(slaves)),
        place(static_cast<std::size_t>(model.model().mesh.num_nodes()), -1),
        search(slaves, model.config().condensed.max_contact_iterations) {
    for (int i = 0; i < slaves; ++i) {
      initial_penetration[i] = pair(i).initial_penetration_mm;
    }
    for (std::size_t i = 0; i < outputs.region.size(); ++i) {
      place[static_cast<std::size_t>(outputs.region[i])] = static_cast<int>(i);
    }
  }
  const contact::ContactPair& pair(int slave) const {
    return model.forward().contact().pairs()[static_cast<std::size_t>(slave)];
  }
  auto slave_compliance() const { return outputs.compliance.bottomRightCorner(slaves, slaves); }
  auto slave_covariance() const { return outputs.covariance.bottomRightCorner(slaves, slaves); }

  Status locate(const SparseData& data);
  void sample(const SparseData& data);
  Status solve_for_set(const contact::ActiveSet& set);
  void record();

  // What find_contact_set() asks of a method.
  Status evaluate(const contact::ActiveSet& set) {
    if (auto status = solve_for_set(set); !status) return status;
    record();
    return {};
  }
  void keep() {}
  void leave_cycle() { search.pivot(forces_of_all, depth, diagonal); }
  const VecX& all_forces() const { return forces_of_all; }
  const VecX& penetration() const { return depth; }
  const VecX& compliance_diagonal() const { return diagonal; }
  static bool out_of_time() { return false; }

  Status rebuild(Points& u) const;
  void finish(const SparseData& data, EstimateStatus outcome, Estimate& estimate);

  const PreparedModel& model;
  CondensedExactOptions options;
  OutputOperators outputs;
  int slaves;
  double beta;
  VecX initial_penetration, diagonal;  // diagonal: of the slaves' compliance
  std::vector<int> place;              // per node: in the region, or -1
  contact::SetSearch search;

  // Of the data; m of them.
  RegionSampling sampling;
  VecX d, variance;          // 3m
  MatrixXd common;           // common error of the data, 3m x q
  MatrixXd data_compliance;  // A Phi_TQ, 3m x s
  MatrixXd data_covariance;  // A Psi_TT A^T, 3m x 3m
  MatrixXd cross;            // A Psi_TQ, 3m x s
  // Of the set; k active slaves.
  std::vector<int> active;
  VecX mu;             // 3m
  VecX slave_weights;  // -Z^T mu, k
  VecX forces;         // k
  VecX forces_of_all;  // s, 0 when open
  VecX depth;          // penetration, s
  Stopwatch watch;     // of the update
  std::vector<IterationRecord> history;
};

Status CondensedExact::Impl::locate(const SparseData& data) {
  const int m = data.size();
  sampling.nodes.setZero(4, m);
  sampling.weights.setZero(4, m);
  for (int i = 0; i < m; ++i) {
    const geometry::TetLocation location = model.locator().locate(data.positions.col(i));
    std::ostringstream text;
    text << "sparse data: point " << i << " at (" << data.positions.col(i).transpose()
         << ") mm lies ";
    if (!(location.distance_mm <= kOutsideTolerance_mm)) {
      text << location.distance_mm << " mm outside the brain";
      return fail(ErrorCode::kInvalidArgument, text.str());
    }
    for (int k = 0; k < 4; ++k) {
      if (std::abs(location.weights[k]) < kLeastBarycentric) continue;
      const int row = place[static_cast<std::size_t>(location.nodes[k])];
      if (row < 0) {
        text << "outside the prepared region, the surroundings of tumour and craniotomy";
        return fail(ErrorCode::kInvalidArgument, text.str());
      }
      sampling.nodes(k, i) = row;
      sampling.weights(k, i) = location.weights[k];
    }
  }
  return {};
}

void CondensedExact::Impl::sample(const SparseData& data) {
  d = Eigen::Map<const VecX>(data.displacements.data(), data.displacements.size());
  variance.resize(d.size());
  common = data.common_error;
  for (int i = 0; i < data.size(); ++i) {
    variance.segment<3>(3 * i).setConstant(data.sd_mm[i] * data.sd_mm[i]);
  }
  const Eigen::Index region = outputs.region_rows();
  data_compliance = sampling.times(outputs.compliance.topRightCorner(region, slaves));
  cross = sampling.times(outputs.covariance.topRightCorner(region, slaves));
  const MatrixXd half = sampling.times(outputs.covariance.topLeftCorner(region, region));
  data_covariance = sampling.times(half.transpose());
}

Status CondensedExact::Impl::solve_for_set(const contact::ActiveSet& set) {
  active.clear();
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (set[i]) active.push_back(static_cast<int>(i));
  }
  const auto k = static_cast<Eigen::Index>(active.size());
  // [Z^T f0] = D^-1 [(A Phi_TA)^T p_A]
  MatrixXd factor = slave_compliance()(active, active);
  factor.diagonal().array() += 1.0 / beta;
  const MatrixXd data_columns = data_compliance(Eigen::all, active);
  MatrixXd z_f0(k, d.size() + 1);
  z_f0.leftCols(d.size()) = data_columns.transpose();
  z_f0.col(d.size()) = initial_penetration(active);
  if (!blas::cholesky(factor)) {
    return fail(ErrorCode::kSingularMatrix, "contact: the compliance of " + std::to_string(k) +
                                                " active slaves is not positive definite");
  }
  const auto solve_d = [&](auto& b) {
    if (k == 0) return;
    blas::solve_lower(factor, b);
    blas::solve_lower_transposed(factor, b);
  };
  solve_d(z_f0);
  const auto z = z_f0.leftCols(d.size());  // Z^T, k x 3m

  // B Psi B^T + R = Psi_TT + R - W Z^T - (W Z^T)^T,   W = Psi_TA - Z Psi_AA / 2
  MatrixXd innovation = data_covariance;
  innovation.diagonal() += variance;
  if (common.rows() > 0) innovation.noalias() += common * common.transpose();
  VecX right = d;
  if (k > 0) {
    MatrixXd w = cross(Eigen::all, active), product(d.size(), d.size());
    const MatrixXd own = slave_covariance()(active, active);
    blas::multiply_transposed(-0.5, z, own, 1.0, w);
    blas::multiply(1.0, w, z, 0.0, product);
    innovation -= product + product.transpose();
    right.noalias() -= data_columns * z_f0.col(d.size());
  }
  if (!blas::cholesky(innovation)) {
    return fail(ErrorCode::kNotFinite,
                "inversion: the covariance of the data is not positive definite");
  }
  mu = right;
  blas::solve_lower(innovation, mu);
  blas::solve_lower_transposed(innovation, mu);

  // y_free at the slaves, forces, penetration.
  slave_weights.noalias() = -z * mu;
  VecX free = cross.transpose() * mu;
  if (k > 0) free.noalias() += slave_covariance()(Eigen::all, active) * slave_weights;
  forces = initial_penetration(active) - free(active);
  solve_d(forces);
  depth = initial_penetration - free;
  if (k > 0) depth.noalias() -= slave_compliance()(Eigen::all, active) * forces;
  forces_of_all.setZero(slaves);
  forces_of_all(active) = forces;
  depth(active) = forces / beta;  // by construction; the sum has it up to rounding
  return {};
}

void CondensedExact::Impl::record() {
  // d - A u = R mu, by the equation for mu.
  VecX residual = variance.cwiseProduct(mu);
  if (common.rows() > 0) residual.noalias() += common * (common.transpose() * mu);
  IterationRecord entry;
  entry.iteration = static_cast<int>(history.size()) + 1;
  entry.misfit_mm =
      mean_std_of_norms(Eigen::Map<const Points>(residual.data(), 3, residual.size() / 3));
  const PenetrationSummary summary = summarise_penetration(depth);
  entry.penetrating = summary.penetrating;
  entry.max_penetration_mm = summary.max_mm;
  entry.elapsed_ms = watch.milliseconds();
  history.push_back(entry);
}

Status CondensedExact::Impl::rebuild(Points& u) const {
  Points load = Points::Zero(3, model.model().mesh.num_nodes());  // H^T B^T mu
  for (Eigen::Index i = 0; i < sampling.nodes.cols(); ++i) {
    for (int k = 0; k < 4; ++k) {
      const auto row = static_cast<std::size_t>(sampling.nodes(k, i));
      load.col(outputs.region[row]) += sampling.weights(k, i) * mu.segment<3>(3 * i);
    }
  }
  for (std::size_t i = 0; i < active.size(); ++i) {
    load.col(pair(active[i]).slave) +=
        slave_weights[static_cast<Eigen::Index>(i)] * pair(active[i]).normal;
  }
  if (auto status = model.forward().solve(load, u); !status) return status;
  Points force = model.prior().apply(u);
  for (std::size_t i = 0; i < active.size(); ++i) {
    force.col(pair(active[i]).slave) +=
        forces[static_cast<Eigen::Index>(i)] * pair(active[i]).normal;
  }
  return model.forward().solve(force, u);
}

void CondensedExact::Impl::finish(const SparseData& data, EstimateStatus outcome,
                                  Estimate& estimate) {
  const IterationRecord& last = history.back();
  estimate.status = outcome;
  std::ostringstream reason;
  if (outcome == EstimateStatus::kConverged) {
    reason << "contact holds to " << contact::kContactTolerance_mm << " mm at iteration "
           << search.iteration();
  } else {
    reason << "contact did not settle in " << search.iteration()
           << " iterations; best iterate returned";
  }
  estimate.reason = reason.str();
  estimate.sd_mm.resize(0);
  estimate.misfit_mm = last.misfit_mm;
  estimate.initial_misfit_mm = mean_std_of_norms(data.displacements);
  estimate.contact = {static_cast<int>(active.size()), last.penetrating, last.max_penetration_mm,
                      static_cast<int>(history.size())};
  estimate.active_slaves.clear();
  for (const int slave : active) estimate.active_slaves.push_back(pair(slave).slave);
  estimate.contact_force_n = forces;
  estimate.history = history;
  estimate.prior_scales.fill(1.0);
  estimate.sources.clear();
}

CondensedExact::CondensedExact(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
CondensedExact::CondensedExact(CondensedExact&&) noexcept = default;
CondensedExact& CondensedExact::operator=(CondensedExact&&) noexcept = default;
CondensedExact::~CondensedExact() = default;

Result<CondensedExact> CondensedExact::build(const PreparedModel& model,
                                             const CondensedExactOptions& options) {
  auto outputs = output_operators(model, options.progress, options.stop, options.threads);
  if (!outputs) return tl::unexpected(outputs.error());
  return CondensedExact(std::make_unique<Impl>(model, options, std::move(*outputs)));
}

void CondensedExact::reset() { impl_->search.forget(); }

std::uint64_t CondensedExact::bytes() const {
  const OutputOperators& outputs = impl_->outputs;
  return sizeof(double) *
         static_cast<std::uint64_t>(outputs.compliance.size() + outputs.covariance.size());
}

Status CondensedExact::update(const SparseData& data, Estimate& estimate,
                              const InversionOptions& asked) {
  Impl& impl = *impl_;
  impl.watch = Stopwatch();
  if (auto status = check_data(data); !status) return status;
  if (auto status = check_whole(data); !status) return status;
  if (auto status = impl.locate(data); !status) return status;
  impl.sample(data);

  if (!impl.options.warm_start) impl.search.forget();
  impl.history.clear();
  const auto end = find_contact_set(impl.search, impl, asked.stop);
  if (!end) return tl::unexpected(end.error());
  const Stopwatch rebuilding;
  Points displacement;
  if (auto status = impl.rebuild(displacement); !status) return status;
  if (!displacement.allFinite() || !impl.forces.allFinite()) {
    impl.search.forget();
    return fail(ErrorCode::kNotFinite, "inversion: the estimate is not finite");
  }
  estimate.displacement = std::move(displacement);
  estimate.rebuild_ms = rebuilding.milliseconds();
  impl.finish(
      data,
      *end == SearchEnd::kSolved ? EstimateStatus::kConverged : EstimateStatus::kIterationLimit,
      estimate);
  return check_estimate(impl.model.model().mesh, impl.model.config().material, estimate);
}

}  // namespace brainshift::inversion
