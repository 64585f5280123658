// SPDX-License-Identifier: GPL-3.0-or-later
// A toy patient, its condensed operators, and the posterior by dense linear algebra.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "common/core/random.hpp"
#include "common/fem/body_loads.hpp"
#include "common/fem/sampling.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "tests/support/contact_search.hpp"
#include "tests/support/dense.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::inversion {

// Posterior mean and covariance of u for a given active set, from solves with K_p column by column.
struct DirectPosterior {
  VecX mean;
  Eigen::MatrixXd covariance;  // where it is asked for
};
enum class DirectCovariance { kNo, kYes };

class Condensed : public ::testing::TestWithParam<Boundary> {
 protected:
  static CaseConfig config() {
    CaseConfig config = test_support::toy_config();
    config.condensed.max_rank = 600;
    config.condensed.uncertainty_nodes = 300;  // more than there are: all
    config.prior.estimate_scales = false;
    return config;
  }
  static std::shared_ptr<const BrainModel> patient() {
    static const auto model = std::make_shared<const BrainModel>(test_support::toy_patient());
    return model;
  }
  static const PreparedModel& prepared(Boundary boundary) {
    static const PreparedModel contact =
        std::move(*PreparedModel::prepare(patient(), config(), Boundary::kContact));
    static const PreparedModel fixed =
        std::move(*PreparedModel::prepare(patient(), config(), Boundary::kFixed));
    return boundary == Boundary::kContact ? contact : fixed;
  }
  static std::shared_ptr<const CondensedOperators> operators(Boundary boundary) {
    static const auto contact = std::make_shared<const CondensedOperators>(
        std::move(*condense(prepared(Boundary::kContact))));
    static const auto fixed = std::make_shared<const CondensedOperators>(
        std::move(*condense(prepared(Boundary::kFixed))));
    return boundary == Boundary::kContact ? contact : fixed;
  }
  static CondensedInverter inverter(Boundary boundary, const CondensedOptions& options = {},
                                    const CaseConfig& with = config()) {
    static const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
    return value_or_fail(CondensedInverter::build(operators(boundary), locator, with, options));
  }
  // Noisy displacements of the data region's nodes, from a sagging truth with contact.
  static SparseData sagging_data(Boundary boundary, double noise_mm, std::uint64_t seed = 4) {
    const PreparedModel& model = prepared(boundary);
    const BrainModel& brain = *patient();
    const Points load =
        fem::buoyancy_load(brain.mesh, model.config().material, brain.gravity_direction,
                           brain.fluid_plane_depth_mm + 25.0, brain.gravity_direction);
    const auto truth =
        value_or_fail(test_support::solve_with_contact(model.forward(), 40.0 * load));
    Random random(seed);
    const auto& region = operators(boundary)->region;
    const auto m = static_cast<Eigen::Index>(region.size());
    SparseData data{Points(3, m), Points(3, m), VecX::Constant(m, 0.2)};
    for (Eigen::Index i = 0; i < m; ++i) {
      const NodeIndex node = region[static_cast<std::size_t>(i)];
      data.positions.col(i) = brain.mesh.nodes.col(node);
      data.displacements.col(i) =
          truth.displacement.col(node) + noise_mm * random.normal() * random.direction();
    }
    return data;
  }

  static DirectPosterior direct_posterior(Boundary boundary, const SparseData& data,
                                          const std::vector<NodeIndex>& active_nodes,
                                          const PriorScaleValues& scales = kAsInTheCase,
                                          DirectCovariance covariance = DirectCovariance::kNo) {
    const PreparedModel& model = prepared(boundary);
    const prior::ForcePrior forces = scaled_prior(model, scales);
    const contact::ForwardModel& forward = model.forward();
    const Eigen::Index n3 = patient()->mesh.nodes.size();
    contact::ActiveSet active(static_cast<std::size_t>(forward.contact().num_slaves()), 0);
    for (std::size_t i = 0; i < active.size(); ++i) {
      const NodeIndex slave = forward.contact().pairs()[i].slave;
      active[i] = std::count(active_nodes.begin(), active_nodes.end(), slave) > 0;
    }
    linalg::SymmetricMatrix k_p = forward.stiffness();
    forward.contact().add_stiffness(k_p, forward.dofs(), active);
    const auto factor = linalg::SparseCholesky::factorise(k_p);
    const auto of_columns = [&](const Eigen::MatrixXd& right, const auto& value) {
      Eigen::MatrixXd result(n3, right.cols());
      for (Eigen::Index j = 0; j < right.cols(); ++j) {
        const Points column = value(Eigen::Map<const Points>(right.col(j).data(), 3, n3 / 3));
        result.col(j) = Eigen::Map<const VecX>(column.data(), n3);
      }
      return result;
    };
    const auto solved = [&](const Eigen::MatrixXd& right) {
      return of_columns(right, [&](const Points& load) {
        return forward.dofs().expand(factor->solve(forward.dofs().restrict_to(load)));
      });
    };
    // The prior covariance of u times `right`.
    const auto expected = [&](const Eigen::MatrixXd& right) {
      return solved(of_columns(solved(right), [&](const Points& u) { return forces.apply(u); }));
    };
    Points gaps = Points::Zero(3, n3 / 3);
    forward.contact().add_load(gaps, active);
    const VecX shift = solved(Eigen::Map<const VecX>(gaps.data(), n3));
    const auto weights =
        fem::sampling_matrix(model.locator(), static_cast<int>(n3 / 3), data.positions, 1e-6);
    // A datum along n has the row n^T A; rows of zeros with d = 0 and any variance say nothing.
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(3 * data.size(), n3);
    VecX noise(3 * data.size()), d = VecX::Zero(3 * data.size());
    for (int i = 0; i < data.size(); ++i) {
      Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3, n3);
      for (fem::SamplingMatrix::InnerIterator it(*weights, i); it; ++it) {
        for (int axis = 0; axis < 3; ++axis) rows(axis, 3 * it.col() + axis) = it.value();
      }
      Vec3 measured = data.displacements.col(i);
      if (data.along_direction(i)) {
        const Vec3 n = data.directions.col(i);
        rows.row(0) = (n.transpose() * rows).eval();
        rows.bottomRows(2).setZero();
        measured = Vec3(n.dot(measured), 0.0, 0.0);
      }
      a.middleRows(3 * i, 3) = rows;
      d.segment<3>(3 * i) = measured;
      noise.segment<3>(3 * i).setConstant(data.sd_mm[i] * data.sd_mm[i]);
    }
    const Eigen::MatrixXd towards = expected(a.transpose());
    Eigen::MatrixXd innovation = a * towards;
    innovation.diagonal() += noise;
    DirectPosterior posterior;
    posterior.mean = shift + towards * test_support::solve_positive(innovation, d - a * shift);
    if (covariance == DirectCovariance::kYes) {
      posterior.covariance =
          expected(Eigen::MatrixXd::Identity(n3, n3)) -
          towards * test_support::solve_positive(innovation, towards.transpose());
    }
    return posterior;
  }
};

}  // namespace brainshift::inversion
