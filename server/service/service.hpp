// SPDX-License-Identifier: GPL-3.0-or-later
// Service: what the daemon answers. It turns requests into calls of the session, acts on the
// session's events, and makes encoded updates for the outbox and records for the journal of its
// results. It drives the session (server/session) from three threads, under one mutex:
//
//   transport   requests; clients that leave
//   preparer    makes models ready, one at a time
//   worker      runs the pipeline, one observation at a time
//
//   request                 reply
//   StatusRequest           StatusReply, always
//   StartSessionRequest     StartSessionReply later, when the session is ready
//   ModelRequest            ModelReply
//   ReportRequest           ReportReply, always
//   SubscribeRequest        SessionState, then updates and, when the session or its phase changes,
//                           SessionState again. A choice that holds no node is an error.
//   Observation             ObservationReply when accepted; updates follow
//   anything else           ErrorReply (protocol)
// Without a model everything but status, report and subscribe gets ErrorReply (model_not_ready).
//
// What a SessionState says holds for kValidity after the viewer sent the request for it, by the
// viewer's clock (common/values/session_state.hpp): three renewals may be lost.
//
// An update is encoded once: subscribers and the journal get the same bytes. They carry the time of
// their own encoding, which is why the timings stand at their end, and as journal_ms the time that
// the newest observation took to queue for the journal, which lies on the way to this update. The
// update's own record can only be queued when its bytes are final; it moves them and takes no time.
//
// Every subscriber receives every final update with its verdict, the unusable ones too. A late
// subscriber's first field is the last usable one.
//
// While the journal does not record, its error is added to the left_out of every update.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/stopwatch.hpp"
#include "common/values/brain_model.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/frame.hpp"
#include "common/wire/report.hpp"
#include "server/delivery/selections.hpp"
#include "server/journal/journal.hpp"
#include "server/operations/counters.hpp"
#include "server/operations/latency_record.hpp"
#include "server/operations/service_manager.hpp"
#include "server/session/session.hpp"
#include "server/transport/outbox.hpp"
#include "server/transport/router.hpp"

namespace brainshift::server {

// On the preparer's thread, one at a time. kUnavailable when stopped.
using MakeSessionModel = std::function<Result<std::unique_ptr<SessionModel>>(
    const SessionRequest&, const std::stop_token&)>;

struct ServiceOptions {
  std::string version;
  std::shared_ptr<const BrainModel> model;  // null: no model is loaded
  MakeSessionModel make_model;              // needed with a model
  std::filesystem::path journal_dir;        // empty: no journal
  std::filesystem::path case_file;          // metadata of the journal
  std::uint64_t journal_bytes = Journal::Options{}.max_session_bytes;
  // On what updates are computed, for the journal and for clients (DaemonStatus).
  std::string build = {};
  std::string machine = {};
  std::string blas_kernel = {};
  // Of a field's data (SessionState): above them it is aged, and has expired.
  std::chrono::milliseconds aged_after{30'000};
  std::chrono::milliseconds expired_after{120'000};
  OpenSink open_journal = open_surgery_file;
  std::uint64_t boot_id = 0;                           // 0: a random one
  std::function<std::uint64_t()> log_lines_lost = {};  // on any thread; may be empty
  // On the transport thread, while that turns (RequestHandler::turned). May be empty.
  std::function<void()> on_turn = {};
};

class Service final : public RequestHandler {
 public:
  // The outbox must outlive the service.
  Service(ServiceOptions options, Outbox& outbox);
  ~Service() override;

  std::optional<Reply> handle(const std::string& peer, const wire::Frame& frame) override;
  void left(const std::string& peer) override;
  void turned(const Peers& peers, const wire::DoorFigures& door) override;

  // How the daemon fares, now. From any thread.
  wire::DaemonReport report() const;
  WorkerHealth worker_health() const;
  SessionState session_state() const;

  static constexpr std::chrono::milliseconds kValidity{1000};

  // Ends the inversion, then writes the journal out. Idempotent. False: a thread has not ended
  // within the grace (a library that heeds no stop); the journal is closed, but nothing that the
  // thread uses may be destroyed: the process must end.
  bool stop(std::chrono::milliseconds grace = std::chrono::hours(24));

 private:
  Reply observe(const std::string& peer, const wire::Frame& frame);
  Reply subscribe(const wire::Frame& frame);
  DaemonStatus status() const;
  std::optional<wire::JournalFigures> journal_figures() const;

  // Calls step() until it is stopped: the loop of preparer and worker. A step that throws (memory
  // that is not to be had) costs what it was doing.
  void repeat(const std::stop_token& stop, void (Service::*step)(const std::stop_token&));
  void prepare(const std::stop_token& stop);  // one model
  void work(const std::stop_token& stop);     // one observation
  void answer(const Job& job, Result<Update> result);
  void publish(UpdateMessage message, const Job& job);

  // With the mutex held.
  void act();  // on the session's events
  void begin_journal(const SessionRequest& request, const SessionInfo& info);
  void push_state();
  void reply(const StartTicket& ticket, const Result<SessionInfo>& info);
  SessionState state_now() const;

  const ServiceOptions options_;  // boot_id is set
  Outbox& outbox_;
  const Stopwatch uptime_;
  std::atomic<double> journal_ms_{0.0};   // the newest observation's way into the journal
  std::string encoded_model_;             // made once, on the first request
  std::optional<Selections> selections_;  // empty without a model; of the transport thread
  Counters counters_;
  UsualTime usual_time_;  // worker only
  mutable std::mutex viewers_mutex_;
  std::vector<wire::ViewerFigures> viewers_;  // `peer` holds the routing id as it is
  std::uint32_t clients_ = 0;
  wire::DoorFigures door_;
  std::unique_ptr<Journal> journal_;  // null without a journal folder

  mutable std::mutex mutex_;  // of the session, and of the order of states and records
  std::condition_variable_any wake_;
  std::optional<Session> session_;  // empty without a model
  int at_work_ = 0;                 // preparer and worker

  std::jthread preparer_;  // the threads last: they use everything above
  std::jthread worker_;
};

}  // namespace brainshift::server
