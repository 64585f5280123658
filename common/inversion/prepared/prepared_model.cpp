// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/prepared/prepared_model.hpp"

#include <utility>

#include "common/core/stopwatch.hpp"
#include "common/core/units.hpp"
#include "common/prior/load_modes.hpp"

namespace brainshift::inversion {
namespace {

prior::ForcePrior build_prior(const BrainModel& model, const PriorConfig& config,
                              Eigen::MatrixXd modes) {
  return prior::ForcePrior(
      model.mesh.nodes, fem::nodal_volumes(model.mesh), config.correlation_length_mm,
      units::force_density_from_n_m3(config.force_density_sd_n_m3), std::move(modes));
}

}  // namespace

prior::ForcePrior scaled_prior(const PreparedModel& model, const PriorScaleValues& scales) {
  PriorConfig config = model.config().prior;
  const prior::LoadModeCounts counts = prior::load_mode_counts(config);
  config.force_density_sd_n_m3 *= scales[static_cast<std::size_t>(PriorPart::kOther)];
  Eigen::MatrixXd modes = model.prior().modes();
  for (int j = 0; j < static_cast<int>(modes.cols()); ++j) {
    modes.col(j) *= scales[static_cast<std::size_t>(prior::prior_part(j, counts))];
  }
  return build_prior(model.model(), config, std::move(modes));
}

PreparedModel::PreparedModel(std::shared_ptr<const BrainModel> model, CaseConfig config,
                             contact::ForwardModel forward, prior::ForcePrior prior)
    : model_(std::move(model)),
      config_(std::move(config)),
      forward_(std::move(forward)),
      prior_(std::move(prior)),
      locator_(model_->mesh) {}

Result<PreparedModel> PreparedModel::prepare(std::shared_ptr<const BrainModel> model,
                                             const CaseConfig& config, Boundary boundary,
                                             const Progress& progress) {
  const Stopwatch whole;
  auto forward = contact::ForwardModel::build(*model, config, boundary, progress);
  if (!forward) return tl::unexpected(forward.error());
  const Stopwatch prior_watch;
  report(progress, "prior", 0.0);
  prior::ForcePrior prior = build_prior(*model, config.prior, prior::load_modes(*model, config));
  const double prior_s = prior_watch.seconds();

  PreparedModel prepared(std::move(model), config, std::move(*forward), std::move(prior));
  const fem::StiffnessFactor& factor = prepared.forward_.factor();
  PrepareTimings& timings = prepared.timings_;
  timings.assemble_s = prepared.forward_.assemble_seconds();
  timings.analyse_s = factor.analyse_seconds();
  timings.factor_s = factor.factor_seconds();
  timings.prior_s = prior_s;
  timings.factor_nonzeros = factor.nonzeros();
  timings.bytes = prepared.forward_.bytes() + prepared.prior_.bytes();
  timings.total_s = whole.seconds();
  report(progress, "ready", 1.0);
  return prepared;
}

}  // namespace brainshift::inversion
