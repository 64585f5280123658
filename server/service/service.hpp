// SPDX-License-Identifier: GPL-3.0-or-later
// Service: what the daemon answers. Turns requests into calls of the session, and what the session
// publishes into encoded updates for the outbox and records for the journal.
//
//   request                 reply
//   StatusRequest           StatusReply, always
//   StartSessionRequest     StartSessionReply later, when the model is prepared
//   ModelRequest            ModelReply
//   SubscribeRequest        SubscribeReply, then updates
//   Observation             ObservationReply when accepted; updates follow
//   anything else           ErrorReply (protocol)
// Without a model everything but status and subscribe gets ErrorReply (model_not_ready).
//
// An error of the journal is added to the left_out of every update until the next session.
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/values/brain_model.hpp"
#include "common/core/error.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/frame.hpp"
#include "server/journal/journal.hpp"
#include "server/session/session.hpp"
#include "server/transport/outbox.hpp"
#include "server/transport/router.hpp"

namespace brainshift::server {

struct ServiceOptions {
  std::string version;
  std::shared_ptr<const BrainModel> model;  // null: no model is loaded
  std::function<Result<Prepared>(const wire::SessionRequest&)> prepare;
  std::filesystem::path journal_dir;  // empty: no journal
  std::filesystem::path case_file;    // metadata of the journal
  OpenSink open_journal = open_surgery_file;
};

class Service final : public RequestHandler {
 public:
  // The outbox must outlive the service.
  Service(ServiceOptions options, Outbox& outbox);
  ~Service() override;

  std::optional<Reply> handle(const std::string& peer, const wire::Frame& frame) override;

  // Ends the inversion, then writes the journal out. Idempotent.
  void stop();

 private:
  std::optional<Reply> start_session(const std::string& peer, const wire::Frame& frame);
  Reply observe(const wire::Frame& frame);
  wire::DaemonStatus status() const;
  void begin_journal(const wire::SessionRequest& request, const wire::SessionInfo& info);
  void publish(wire::UpdateMessage message);

  const ServiceOptions options_;
  Outbox& outbox_;
  const std::chrono::steady_clock::time_point started_;
  std::string encoded_model_;         // made once, on the first request
  std::unique_ptr<Journal> journal_;  // null without a journal folder
  std::unique_ptr<Session> session_;  // null without a model; ends before the journal
};

}  // namespace brainshift::server
