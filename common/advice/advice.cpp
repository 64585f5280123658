// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/advice/advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/core/thread_team.hpp"
#include "common/geometry/surface.hpp"
#include "common/inversion/contract/data_check.hpp"
#include "common/linalg/blas.hpp"
#include "common/operators/encode_columns.hpp"

namespace brainshift::advice {
namespace {

namespace blas = linalg::blas;

constexpr int kTargetPoints = 100;
constexpr std::uint64_t kTargetSeed = 20100402;

double sd_of(double squares, const PlaceRows& target) {
  return std::sqrt((squares / 3.0 + target.left_out_mm2.sum()) /
                   static_cast<double>(target.left_out_mm2.size()));
}

// D^-1/2 [B | C]
struct Whitened {
  Eigen::MatrixXd modes, common;
};
Whitened whiten(const SparseData& data, const PlaceRows& at) {
  const Eigen::Index r = at.modes.cols(), m = data.rows();
  const bool shared = data.common_error.rows() > 0;
  Whitened whitened{Eigen::MatrixXd(m, r),
                    Eigen::MatrixXd(m, shared ? data.common_error.cols() : Eigen::Index{0})};
  Eigen::Index row = 0;
  for (int i = 0; i < data.size(); ++i) {
    // As SampledOperators: what the modes leave out of a datum beside the region adds to its error.
    const double left_out = at.region[static_cast<std::size_t>(i)] ? 0.0 : at.left_out_mm2[i];
    const double sd = std::sqrt(data.sd_mm[i] * data.sd_mm[i] + left_out);
    const Eigen::Index rows = data.along_direction(i) ? 1 : 3;
    const auto put = [&](const auto& three, auto&& out) {
      if (rows == 3) {
        out = three / sd;
      } else {
        out = data.directions.col(i).transpose() * three / sd;
      }
    };
    put(at.modes.middleRows<3>(3 * i), whitened.modes.middleRows(row, rows));
    if (shared) put(data.common_error.middleRows<3>(3 * i), whitened.common.middleRows(row, rows));
    row += rows;
  }
  return whitened;
}

// Displacement of the estimate at points of the undeformed brain.
Points moved(const Points& places, const geometry::TetLocator& locator, const Points& field) {
  Points u(3, places.cols());
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    u.col(i) = geometry::value_at(locator.locate(places.col(i)), field);
  }
  return u;
}

// What the registration stage makes of a candidate if the brain lies as estimated.
Result<SparseData> data_of(const Candidate& candidate, const pipeline::Pipeline& pipeline,
                           const CaseConfig& config, const geometry::TetLocator& locator,
                           const Points& field) {
  const auto registered = pipeline::register_observation(
      observed(candidate, moved(candidate.places, locator, field)), pipeline.targets(), config);
  if (!registered) return tl::unexpected(registered.error());
  if (!registered->surface) return registered->data;
  return registered->surface->at(field(Eigen::all, registered->surface->nodes()));
}

}  // namespace

Target tumour_target(const BrainModel& model) {
  return {"tumour boundary", geometry::sample_surface(model.tumour, kTargetPoints, kTargetSeed)};
}

Posterior::Posterior(inversion::PosteriorModes modes, const geometry::TetLocator& locator)
    : modes_(std::move(modes)), locator_(locator) {}

Result<PlaceRows> Posterior::at(const Points& points) const {
  const CondensedOperators& operators = *modes_.operators;
  std::vector<geometry::TetLocation> locations;
  std::vector<NodeIndex> nodes;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    locations.push_back(locator_.locate(points.col(i)));
    if (!(locations.back().distance_mm <= inversion::kOutsideTolerance_mm)) {
      const Vec3 x = points.col(i);
      return invalid(
          fmt::format("point ({:.1f}, {:.1f}, {:.1f}) mm lies {:.1f} mm outside the brain", x[0],
                      x[1], x[2], locations.back().distance_mm));
    }
    for (const int node : locations.back().nodes) nodes.push_back(node);
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());

  // V of the nodes.
  ThreadTeam team(1);
  const auto r = static_cast<int>(modes_.factor.cols());
  Eigen::MatrixXd rows =
      decode_rows(operators.responses, nodes, column_range(modes_.first_mode, r), team)
          .cast<double>();
  if (!modes_.active.empty()) {
    std::vector<int> columns = modes_.active;
    for (int& column : columns) column = operators.contact_column(column);
    rows.noalias() -=
        decode_rows(operators.responses, nodes, columns, team).cast<double>() * modes_.contact;
  }
  PlaceRows at{Eigen::MatrixXd::Zero(3 * points.cols(), r), VecX::Zero(points.cols()), {}};
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    bool region = true;
    for (int k = 0; k < 4; ++k) {
      const geometry::TetLocation& location = locations[static_cast<std::size_t>(i)];
      const NodeIndex node = location.nodes[k];
      const double weight = location.weights[k];
      if (weight == 0.0) continue;
      const auto row = std::lower_bound(nodes.begin(), nodes.end(), node) - nodes.begin();
      at.modes.middleRows<3>(3 * i) += weight * rows.middleRows<3>(3 * row);
      for (int c = 0; c < 4; ++c) {
        at.left_out_mm2[i] +=
            weight * static_cast<double>(operators.control_weights(c, node)) *
            operators.truncated_variance_mm2.row(operators.control_neighbours(c, node))
                .dot(modes_.left_out);
      }
      region &= std::binary_search(operators.region.begin(), operators.region.end(), node);
    }
    at.region.push_back(region);
  }
  return at;
}

double Posterior::sd_mm(const PlaceRows& target) const {
  return sd_of((target.modes * modes_.factor.triangularView<Eigen::Lower>()).squaredNorm(), target);
}

Result<double> Posterior::sd_after_mm(const PlaceRows& target, const SparseData& data,
                                      const PlaceRows& at_data) const {
  const Whitened rows = whiten(data, at_data);
  const Eigen::Index r = modes_.factor.cols(), all = r + rows.common.cols();
  Eigen::MatrixXd whitened(rows.modes.rows(), all);  // W
  whitened << rows.modes * modes_.factor, rows.common;
  Eigen::MatrixXd factor = Eigen::MatrixXd::Identity(all, all);
  blas::gram(whitened, 1.0, factor);
  if (!whitened.allFinite() || !blas::cholesky(factor)) {
    return fail(ErrorCode::kNotFinite, "the data have a standard deviation that is not above 0 mm");
  }
  Eigen::MatrixXd left = Eigen::MatrixXd::Zero(all, target.modes.rows());
  left.topRows(r) = (target.modes * modes_.factor).transpose();
  blas::solve_lower(factor, left);
  return sd_of(left.squaredNorm(), target);
}

Result<std::vector<Advice>> rank(const pipeline::Pipeline& pipeline, const CaseConfig& config,
                                 const geometry::TetLocator& locator, const Estimate& estimate,
                                 const std::vector<Candidate>& candidates, const Target& target) {
  auto modes = pipeline.posterior();
  if (!modes) {
    return fail(ErrorCode::kNotConverged, "advice: the method does not say what is left unknown");
  }
  const Posterior posterior(std::move(*modes), locator);
  const auto at_target = posterior.at(target.points);
  if (!at_target) {
    return fail(at_target.error().code, "target " + target.name + ": " + at_target.error().message);
  }
  const double scale = std::max(1.0, estimate.misfit_ratio);
  std::vector<Advice> advice;
  for (const Candidate& candidate : candidates) {
    Advice one{candidate, 0, scale * posterior.sd_mm(*at_target), 0.0, {}};
    const auto judge = [&]() -> Result<double> {
      const auto data = data_of(candidate, pipeline, config, locator, estimate.displacement);
      if (!data) return tl::unexpected(data.error());
      one.data = data->size();
      const auto at_data = posterior.at(data->positions);
      if (!at_data) return tl::unexpected(at_data.error());
      return posterior.sd_after_mm(*at_target, *data, *at_data);
    };
    const auto after = judge();
    one.after_mm = after ? scale * *after : one.before_mm;
    if (!after) one.reason = after.error().message;
    advice.push_back(std::move(one));
  }
  std::stable_sort(advice.begin(), advice.end(), [](const Advice& a, const Advice& b) {
    if (a.reason.empty() != b.reason.empty()) return a.reason.empty();
    return a.reduction_mm() > b.reduction_mm();
  });
  return advice;
}

}  // namespace brainshift::advice
