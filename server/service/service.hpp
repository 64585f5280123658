// SPDX-License-Identifier: GPL-3.0-or-later
// Service: what the daemon answers. It turns requests into calls of the session, and what the
// session publishes into encoded updates for the outbox and records for the journal.
//
//   request                 reply
//   StatusRequest           StatusReply, always
//   StartSessionRequest     StartSessionReply later, when the session is ready
//   ModelRequest            ModelReply
//   SubscribeRequest        SubscribeReply, then updates
//   Observation             ObservationReply when accepted; updates follow
//   anything else           ErrorReply (protocol)
// Without a model everything but status and subscribe gets ErrorReply (model_not_ready).
//
// An update is encoded once: subscribers and the journal get the same bytes. They carry the time of
// their own encoding, which is why the timings stand at their end, and as journal_ms the time that
// the newest observation took to queue for the journal, which lies on the way to this update. The
// update's own record can only be queued when its bytes are final; it moves them and takes no time.
//
// Every subscriber receives every final update with its verdict, the unusable ones too. A late
// subscriber's first field is the last usable one.
//
// An error of the journal is added to the left_out of every update until the next session.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/core/error.hpp"
#include "common/core/stopwatch.hpp"
#include "common/values/brain_model.hpp"
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
  MakeSessionModel make_model;              // needed with a model
  std::filesystem::path journal_dir;        // empty: no journal
  std::filesystem::path case_file;          // metadata of the journal
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
  const Stopwatch uptime_;
  std::atomic<double> journal_ms_{0.0};  // the newest observation's way into the journal
  std::string encoded_model_;            // made once, on the first request
  std::unique_ptr<Journal> journal_;     // null without a journal folder
  std::unique_ptr<Session> session_;     // null without a model; ends before the journal
};

}  // namespace brainshift::server
