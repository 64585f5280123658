// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/model_store.hpp"

#include <spdlog/spdlog.h>

#include <utility>

#include "common/core/stopwatch.hpp"
#include "common/inversion/prepared/condense.hpp"

namespace brainshift::server {
namespace {

using inversion::PreparedModel;

// The parts that the scene's plan leaves out, for the condensed method.
inversion::CondensedOptions condensed_options(const pipeline::ScenePlan& plan,
                                              const BrainModel& model, const CaseConfig& config) {
  inversion::CondensedOptions options;
  options.contact = plan.contact;
  options.uncertainty = plan.uncertainty;
  options.gravity_modes = plan.gravity_modes;
  if (!plan.far_field) {
    options.region_of_interest =
        pipeline::region_of_interest(model, config.scene.region_of_interest_mm);
  }
  return options;
}

tl::unexpected<Error> stopped() {
  return fail(ErrorCode::kUnavailable, "the preparation was stopped");
}

}  // namespace

ModelStore::ModelStore(std::shared_ptr<const BrainModel> model, CaseConfig config,
                       std::vector<CondensedOperators> operators, ReadOperators read)
    : model_(std::move(model)),
      config_(std::move(config)),
      read_(std::move(read)),
      locator_(std::make_shared<const geometry::TetLocator>(model_->mesh)) {
  for (CondensedOperators& one : operators) keep(std::move(one));
}

std::shared_ptr<const CondensedOperators> ModelStore::keep(CondensedOperators operators) {
  const Boundary boundary = operators.boundary;
  auto shared = std::make_shared<const CondensedOperators>(std::move(operators));
  condensed_.emplace(boundary, shared);
  return shared;
}

Result<std::shared_ptr<const PreparedModel>> ModelStore::factorised(Boundary boundary,
                                                                    const std::stop_token& stop) {
  if (const auto found = factorised_.find(boundary); found != factorised_.end()) {
    return found->second;
  }
  if (stop.stop_requested()) return stopped();
  spdlog::info("factorising boundary={}", to_string(boundary));
  auto made = PreparedModel::prepare(model_, config_, boundary);
  if (!made) return tl::unexpected(made.error());
  auto shared = std::make_shared<const PreparedModel>(std::move(*made));
  factorised_.emplace(boundary, shared);
  return shared;
}

Result<std::shared_ptr<const CondensedOperators>> ModelStore::condensed(
    Boundary boundary, const std::stop_token& stop) {
  if (const auto found = condensed_.find(boundary); found != condensed_.end()) return found->second;
  if (read_) {
    spdlog::info("reading boundary={}", to_string(boundary));
    auto read = read_(boundary);
    if (!read) return tl::unexpected(read.error());
    if (*read) return keep(std::move(**read));
  }
  const auto factor = factorised(boundary, stop);
  if (!factor) return tl::unexpected(factor.error());
  spdlog::info("condensing boundary={}: the model file holds no operators for it",
               to_string(boundary));
  const Stopwatch watch;
  inversion::CondenseOptions options;
  options.stop = stop;
  auto made = inversion::condense(**factor, options);
  if (!made) return tl::unexpected(made.error());
  made->prepare_s = (*factor)->timings().total_s + watch.seconds();
  return keep(std::move(*made));
}

Result<pipeline::MakeInverter> ModelStore::inverters(const SessionRequest& request,
                                                     const pipeline::ScenePlan& plan,
                                                     const std::stop_token& stop) {
  if (request.method == Method::kCondensed) {
    const auto operators = condensed(request.boundary, stop);
    if (!operators) return tl::unexpected(operators.error());
    return [operators = *operators, locator = locator_, config = config_,
            options = condensed_options(plan, *model_, config_)] {
      return inversion::condensed_inverter(operators, locator, config, options);
    };
  }
  const auto factor = factorised(request.boundary, stop);
  if (!factor) return tl::unexpected(factor.error());
  if (stop.stop_requested()) return stopped();
  return [factor = *factor, method = request.method] {
    return inversion::make_inverter(factor, method);
  };
}

Result<std::unique_ptr<SessionModel>> ModelStore::make(const SessionRequest& request,
                                                       const std::stop_token& stop) {
  const Stopwatch watch;
  const auto plan = pipeline::plan_scene(config_, request.method, request.boundary);
  if (!plan) return tl::unexpected(plan.error());
  auto another = inverters(request, *plan, stop);
  if (!another) return tl::unexpected(another.error());
  auto made = (*another)();
  if (!made) return tl::unexpected(made.error());
  SessionInfo info;
  info.model_id = model_->model_id;
  info.nodes = model_->mesh.num_nodes();
  info.tets = model_->mesh.num_tets();
  info.slaves = static_cast<int>(model_->slaves.size());
  info.model_bytes = (*made)->bytes();
  auto pipeline = pipeline::Pipeline::build(*model_, config_, request.method, request.boundary,
                                            std::move(*made), std::move(*another));
  if (!pipeline) return tl::unexpected(pipeline.error());
  info.prepare_s = watch.seconds();
  if (request.method == Method::kCondensed) {  // the work that was done before surgery counts
    const double before_s = condensed_.at(request.boundary)->prepare_s;
    if (before_s > 0.0) info.prepare_s = before_s;
  }
  const bool ends_by_itself = request.method == Method::kCondensed;
  return std::make_unique<SessionModel>(
      SessionModel{std::move(info), std::move(*pipeline), config_.sensing.max_age_s,
                   ends_by_itself ? 1e-3 * config_.condensed.deadline_ms : kNoDeadline_s});
}

}  // namespace brainshift::server
