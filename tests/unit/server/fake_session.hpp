// SPDX-License-Identifier: GPL-3.0-or-later
// A session's model over a fake inverter.
#pragma once

#include <memory>
#include <utility>

#include "server/session/session.hpp"
#include "tests/unit/server/fake_inverter.hpp"

namespace brainshift::server {

inline Result<std::unique_ptr<SessionModel>> fake_session(
    std::unique_ptr<inversion::Inverter> inverter, const SessionRequest& request = {}) {
  auto pipeline = pipeline::Pipeline::build(*small_model(), {}, request.method, request.boundary,
                                            std::move(inverter));
  if (!pipeline) return tl::unexpected(pipeline.error());
  SessionInfo info;
  info.model_id = kModelId;
  return std::make_unique<SessionModel>(SessionModel{std::move(info), std::move(*pipeline)});
}

}  // namespace brainshift::server
