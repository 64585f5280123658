// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/model_store.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "common/inversion/prepared/condense.hpp"
#include "common/inversion/condensed/condensed_exact.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/inversion/invert.hpp"
#include "server/pipeline/scene_plan.hpp"
#include "server/pipeline/left_out.hpp"
#include "server/pipeline/pipeline.hpp"

namespace brainshift::server {
namespace {

using inversion::CondensedExact;
using inversion::CondensedInverter;
using inversion::PreparedModel;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// The pipeline as the function that a session calls.
Result<Prepared> with_pipeline(const std::shared_ptr<const BrainModel>& model,
                               const CaseConfig& config, Boundary boundary, InvertFunction invert,
                               OmissionFunction omissions = {}) {
  auto pipeline = Pipeline::build(model, config, boundary, std::move(invert), std::move(omissions));
  if (!pipeline) return tl::unexpected(pipeline.error());
  auto shared = std::make_shared<const Pipeline>(std::move(*pipeline));
  Prepared prepared;
  auto evidence = std::make_shared<Evidence>(config.sensing.max_age_s);
  prepared.run = [shared, evidence](const Observation& observation, const RunOptions& options) {
    return shared->run(observation, options, *evidence);
  };
  prepared.begin = [evidence] { evidence->clear(); };
  return prepared;
}

// The parts that the scene's plan leaves out, for the condensed method.
inversion::CondensedOptions condensed_options(const server::ScenePlan& plan, const BrainModel& model,
                                              const CaseConfig& config) {
  inversion::CondensedOptions options;
  options.contact = plan.contact;
  options.uncertainty = plan.uncertainty;
  options.gravity_modes = plan.gravity_modes;
  if (!plan.far_field) {
    options.region_of_interest =
        server::region_of_interest(model, config.scene.region_of_interest_mm);
  }
  return options;
}

}  // namespace

ModelStore::ModelStore(std::shared_ptr<const BrainModel> model, CaseConfig config,
                       std::vector<CondensedOperators> operators)
    : model_(std::move(model)),
      config_(std::move(config)),
      locator_(std::make_shared<const geometry::TetLocator>(model_->mesh)) {
  for (CondensedOperators& one : operators) {
    const Boundary boundary = one.boundary;
    condensed_.emplace(boundary, std::make_shared<const CondensedOperators>(std::move(one)));
  }
}

wire::SessionInfo ModelStore::info() const {
  wire::SessionInfo info;
  info.model_id = model_->model_id;
  info.nodes = model_->mesh.num_nodes();
  info.tets = model_->mesh.num_tets();
  info.slaves = static_cast<int>(model_->slaves.size());
  return info;
}

Result<std::shared_ptr<const PreparedModel>> ModelStore::factorised(Boundary boundary) {
  if (const auto found = factorised_.find(boundary); found != factorised_.end()) {
    return found->second;
  }
  spdlog::info("factorising boundary={}", to_string(boundary));
  auto made = PreparedModel::prepare(model_, config_, boundary);
  if (!made) return tl::unexpected(made.error());
  auto shared = std::make_shared<const PreparedModel>(std::move(*made));
  factorised_.emplace(boundary, shared);
  return shared;
}

Result<std::shared_ptr<const CondensedOperators>> ModelStore::condensed(Boundary boundary) {
  if (const auto found = condensed_.find(boundary); found != condensed_.end()) {
    return found->second;
  }
  const auto factor = factorised(boundary);
  if (!factor) return tl::unexpected(factor.error());
  spdlog::info("condensing boundary={}: the model file holds no operators for it",
               to_string(boundary));
  const auto start = Clock::now();
  auto made = inversion::condense(**factor);
  if (!made) return tl::unexpected(made.error());
  made->prepare_s = (*factor)->timings().total_s + seconds_since(start);
  auto shared = std::make_shared<const CondensedOperators>(std::move(*made));
  condensed_.emplace(boundary, shared);
  return shared;
}

Result<Prepared> ModelStore::prepare_condensed(const wire::SessionRequest& request,
                                               const server::ScenePlan& plan) {
  const auto operators = condensed(request.boundary);
  if (!operators) return tl::unexpected(operators.error());
  auto made = CondensedInverter::build(*operators, locator_, config_,
                                       condensed_options(plan, *model_, config_));
  if (!made) return tl::unexpected(made.error());
  auto inverter = std::make_shared<CondensedInverter>(std::move(*made));
  auto scratch = std::make_shared<Estimate>();  // its memory is reused from update to update
  auto prepared = with_pipeline(
      model_, config_, request.boundary,
      [inverter, scratch](const SparseData& data,
                          const inversion::InversionOptions& options) -> Result<Estimate> {
        if (auto status = inverter->update(data, *scratch, options.moving); !status) {
          return tl::unexpected(status.error());
        }
        return *scratch;
      },
      [inverter, config = config_, boundary = request.boundary](const Estimate& estimate) {
        return inversion_omissions(config, boundary, inverter->omission_errors(),
                                   estimate.contact.active);
      });
  if (!prepared) return prepared;
  prepared->begin = [inverter, forget = prepared->begin] {
    inverter->reset();
    forget();
  };
  prepared->info.model_bytes = (*operators)->bytes();
  prepared->info.prepare_s = (*operators)->prepare_s;
  return prepared;
}

Result<Prepared> ModelStore::prepare_condensed_exact(const wire::SessionRequest& request) {
  const auto factor = factorised(request.boundary);
  if (!factor) return tl::unexpected(factor.error());
  spdlog::info("condensing boundary={} with the whole prior", to_string(request.boundary));
  auto made = CondensedExact::prepare(**factor);
  if (!made) return tl::unexpected(made.error());
  auto inverter = std::make_shared<CondensedExact>(std::move(*made));
  // The inverter refers to the factor.
  auto prepared = with_pipeline(
      model_, config_, request.boundary,
      [inverter, factor = *factor](const SparseData& data,
                                   const inversion::InversionOptions& options) -> Result<Estimate> {
        Estimate estimate;
        auto status = inverter->update(data, estimate, options.stop);
        if (!status) return tl::unexpected(status.error());
        return estimate;
      });
  if (!prepared) return prepared;
  prepared->begin = [inverter, forget = prepared->begin] {
    inverter->reset();
    forget();
  };
  prepared->info.model_bytes = (*factor)->timings().bytes + inverter->bytes();
  return prepared;
}

Result<Prepared> ModelStore::prepare_for_method(const wire::SessionRequest& request,
                                                const server::ScenePlan& plan) {
  switch (request.method) {
    case Method::kCondensed: return prepare_condensed(request, plan);
    case Method::kCondensedExact: return prepare_condensed_exact(request);
    default: return prepare_iterative(request);
  }
}

Result<Prepared> ModelStore::prepare_iterative(const wire::SessionRequest& request) {
  const auto factor = factorised(request.boundary);
  if (!factor) return tl::unexpected(factor.error());
  auto prepared = with_pipeline(
      model_, config_, request.boundary,
      [factor = *factor](const SparseData& data, const inversion::InversionOptions& options) {
        return inversion::invert(*factor, data, options);
      });
  if (!prepared) return prepared;
  prepared->info.model_bytes = (*factor)->timings().bytes;
  return prepared;
}

Result<Prepared> ModelStore::prepare(const wire::SessionRequest& request) {
  const auto start = Clock::now();
  const auto plan = server::plan_scene(config_, request.method, request.boundary);
  if (!plan) return tl::unexpected(plan.error());
  auto prepared = prepare_for_method(request, *plan);
  if (!prepared) return prepared;
  const wire::SessionInfo common = info();
  const wire::SessionInfo own = prepared->info;
  prepared->info = common;
  prepared->info.model_bytes = own.model_bytes;
  // What was done before surgery counts.
  prepared->info.prepare_s = own.prepare_s > 0.0 ? own.prepare_s : seconds_since(start);
  if (request.method != Method::kCondensed || request.measure_full_solve) {
    const auto factor = factorised(request.boundary);
    if (!factor) return tl::unexpected(factor.error());
    prepared->info.full_solve_ms = (*factor)->timings().full_solve_ms;
    prepared->info.factor_s = (*factor)->timings().factor_s;
  }
  return prepared;
}

}  // namespace brainshift::server
