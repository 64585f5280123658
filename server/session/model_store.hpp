// SPDX-License-Identifier: GPL-3.0-or-later
// ModelStore: one loaded model, and what sessions on it share. Made ready piece by piece, when first asked for:
// the condensed method needs the operators of the model file only, the others factorise.
//
// prepare() and what it returns belong to one thread, the session's worker.
#pragma once

#include <map>
#include <memory>

#include "common/values/brain_model.hpp"
#include "common/values/case_config.hpp"
#include "common/values/condensed_operators.hpp"
#include "common/core/error.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "server/pipeline/scene_plan.hpp"
#include "server/session/session.hpp"

namespace brainshift::server {

class ModelStore {
 public:
  // Operators may be missing; they are then made when a session asks for them.
  ModelStore(std::shared_ptr<const BrainModel> model, CaseConfig config,
             std::vector<CondensedOperators> operators);

  // A pipeline for the request's method and boundary, with the parts that the scene carries. Errors as
  // scene::plan_scene, PreparedModel::prepare and condense.
  Result<Prepared> prepare(const wire::SessionRequest& request);

 private:
  Result<std::shared_ptr<const inversion::PreparedModel>> factorised(Boundary boundary);
  Result<std::shared_ptr<const CondensedOperators>> condensed(Boundary boundary);
  Result<Prepared> prepare_for_method(const wire::SessionRequest& request,
                                      const server::ScenePlan& plan);
  Result<Prepared> prepare_condensed(const wire::SessionRequest& request,
                                     const server::ScenePlan& plan);
  Result<Prepared> prepare_condensed_exact(const wire::SessionRequest& request);
  Result<Prepared> prepare_iterative(const wire::SessionRequest& request);
  wire::SessionInfo info() const;

  std::shared_ptr<const BrainModel> model_;
  CaseConfig config_;
  std::shared_ptr<const geometry::TetLocator> locator_;
  std::map<Boundary, std::shared_ptr<const inversion::PreparedModel>> factorised_;
  std::map<Boundary, std::shared_ptr<const CondensedOperators>> condensed_;
};

}  // namespace brainshift::server
