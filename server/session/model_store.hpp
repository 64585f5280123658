// SPDX-License-Identifier: GPL-3.0-or-later
// ModelStore: one loaded model, and what sessions on it share. It is made piece by piece, when a
// session first asks: the condensed method needs the operators of its boundary condition only, from
// the model file, the other methods factorise.
//
// Belongs to one thread, the session's preparer.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/inversion/inverter.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/pipeline/scene.hpp"
#include "common/values/brain_model.hpp"
#include "server/session/session.hpp"

namespace brainshift::server {

class ModelStore {
 public:
  // The operators that the model file has for a boundary condition; empty: none.
  using ReadOperators = std::function<Result<std::optional<CondensedOperators>>(Boundary)>;

  // operators: those at hand. read: asked for the others when a session needs them; empty: there
  // are none. A session whose operators are nowhere makes them.
  ModelStore(std::shared_ptr<const BrainModel> model, CaseConfig config,
             std::vector<CondensedOperators> operators, ReadOperators read = {});

  // For the request's method and boundary, with the parts that the scene carries. Errors as
  // plan_scene, `read`, PreparedModel::prepare, condensed_inverter and make_inverter; kUnavailable
  // when stopped, which is asked for between a factorisation and the next, and between blocks of
  // columns.
  Result<std::unique_ptr<SessionModel>> make(const SessionRequest& request,
                                             const std::stop_token& stop = {});

 private:
  Result<std::shared_ptr<const inversion::PreparedModel>> factorised(Boundary boundary,
                                                                     const std::stop_token& stop);
  Result<std::shared_ptr<const CondensedOperators>> condensed(Boundary boundary,
                                                              const std::stop_token& stop);
  std::shared_ptr<const CondensedOperators> keep(CondensedOperators operators);
  Result<pipeline::MakeInverter> inverters(const SessionRequest& request,
                                           const pipeline::ScenePlan& plan,
                                           const std::stop_token& stop);

  std::shared_ptr<const BrainModel> model_;
  CaseConfig config_;
  ReadOperators read_;
  std::shared_ptr<const geometry::TetLocator> locator_;
  std::map<Boundary, std::shared_ptr<const inversion::PreparedModel>> factorised_;
  std::map<Boundary, std::shared_ptr<const CondensedOperators>> condensed_;
};

}  // namespace brainshift::server
