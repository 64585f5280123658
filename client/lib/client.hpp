// SPDX-License-Identifier: Apache-2.0
// Client: how a navigation system talks to brainshiftd. Links no solver and nothing under the GPL.
//
//   auto client = Client::connect("tcp://127.0.0.1:5555");
//   if (!client) return show(client.error().message);
//   if (auto ready = client->start_session({.case_id = "colin27"}); !ready)
//     return show(ready.error().message);
//   auto model = client->model();                         // the mesh that displacements belong to
//   if (auto ok = client->subscribe(); !ok) return show(ok.error().message);
//
//   Observation seen;
//   seen.case_id = "colin27";
//   seen.source = "ius";
//   seen.sequence = 1;                                    // counts up from 1
//   seen.body = TumourBoundary{boundary_points, 0.5};     // 3 x m, mm; sd per component, mm
//   if (auto taken = client->submit(seen); !taken) return show(taken.error().message);
//
//   auto message = client->next_update(std::chrono::seconds(60));
//   if (message && message->error) warn(message->error->message);
//   else if (message) tell(message->update.estimate.quality);      // verdict, flags, reason
//   if (const auto& shown = client->latest_usable()) {
//     const Points& u = shown->update.estimate.displacement;       // 3 x nodes, mm
//     draw(model->mesh.nodes + u);
//   }
//
// Currency. The top hazard is an old picture that looks current. field_status() says whether the
// field of latest_usable() is current, and if not, why, in a sentence to show. It is stale as soon
// as the daemon has not confirmed it for a second: by this computer's clock from the moment at
// which the question was sent, so that no queue on the way makes it look younger. next_update()
// asks every 250 ms while it waits, subscribes again after a restart, and drops the updates of
// other sessions. A viewer that calls it rarely gets the newest update then, not the oldest, and
// shows stale in between. Draw, at least once a second:
//
//   (void)client->next_update(std::chrono::milliseconds(100));
//   const FieldStatus status = client->field_status();
//   banner(status.currency == Currency::kCurrent ? "" : status.reason);
//
// Quality. Every final update carries a verdict on its field (common/values/quality.hpp): good,
// caution, unusable. An unusable field is no deformation of a brain. It arrives like any other, so
// that the user can be told why; latest_usable() keeps the field before it. Draw that one. When it
// is older than the newest message, say so: what is drawn is then the last that was usable.
//
// Parts. A viewer may choose a region, a spacing, changes beyond a tolerance, and no uncertainty
// (common/values/session_state.hpp); the choices combine:
//
//   FieldChoice near{.region = TumourRegion{40.0}, .tolerance_mm = 0.1};   // mm
//   if (auto ok = client->subscribe(1, near); !ok) return show(ok.error().message);
//
// Update::part then lists the nodes that the columns of the displacement are of; without it they
// are all nodes of the mesh. Look at it before you draw: a part is no whole field. The library puts
// changes into what it holds: with a tolerance t, every node that it hands out is within t of the
// newest update that it received. Where it cannot, it asks for the whole choice again by itself.
//
// Conventions. Coordinates are patient RAS in millimetres. Points are 3 x n matrices, a column per
// point. A displacement moves an undeformed point to its deformed place; its columns are in the
// order of BrainModel::mesh.nodes, or of Update::part. Estimate::sd_mm and Estimate::known have one
// entry per column, or none at all: the standard deviation, mm, and how much of the standard
// deviation before the data they took away, from 0 (a guess from the prior alone) to 1.
//
// Errors. Every call returns a value or an Error: a code to branch on and one sentence to show.
//   kUnavailable    no daemon, no answer in time, a lost connection, or a daemon that is stopping
//   kProtocol       the answer could not be understood
//   kNotAllowed     the role of this client's key does not include the request
//   any other code  the daemon's own answer, e.g. kModelNotReady, kInvalidArgument
// An observation from which no estimate could be made is not an error of next_update(): its
// message arrives with UpdateMessage::error set. The usable estimate before it stays the valid one.
//
// Recording. submit() returns when the daemon has accepted an observation. session_state() tells
// which are on its disk (RecordingState::holds), and why it does not record when it does not.
//
// Threads. A Client is not thread-safe: use each from one thread at a time. Several Clients may
// talk to one daemon, which has one session at a time for all of them.
//
// Waiting. Every call returns within its timeout. Updates that arrive while a call waits for its
// reply are queued for next_update(); the daemon sends no more than the subscription's window.
//
// Lost connections. connect() does not wait for the daemon; the first request does. When the
// daemon goes away while a call waits, the call returns kUnavailable at once instead of at its
// timeout. The connection comes back by itself, and next_update() subscribes again. A daemon that
// was restarted runs no session, or one that somebody else started: its key differs.
//
// Sessions. A session belongs to the client that started it until that client disconnects. Another
// one ends it only with SessionRequest::takeover. submit() names the session for the caller: the
// one that this client started, until it starts another, or, when it only subscribed, the one that
// runs. Of a session that another client has ended submit() sends nothing: session_status().
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "client/lib/client_keys.hpp"
#include "client/lib/field_status.hpp"
#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/observation.hpp"
#include "common/values/session_state.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/report.hpp"

namespace brainshift::client {

// Each time must be at least 1 ms and at most 6 days.
struct ClientOptions {
  // For every request but start_session.
  std::chrono::milliseconds request_timeout{5000};
  // Starting a session may prepare the model, which takes up to minutes.
  std::chrono::milliseconds session_timeout{600000};
  // A daemon that misses three heartbeats counts as gone.
  std::chrono::milliseconds heartbeat_interval{1000};
  // How often next_update() asks what is current while it waits.
  std::chrono::milliseconds renewal_interval{250};
  // Without keys nothing is encrypted, and a daemon that asks for keys does not answer.
  std::optional<ClientKeys> keys = std::nullopt;
};

class Client {
 public:
  // `endpoint`: as ZeroMQ writes it, "tcp://127.0.0.1:5555" or "ipc:///run/brainshift".
  // kInvalidArgument names the endpoint or option that is invalid.
  static Result<Client> connect(const std::string& endpoint, const ClientOptions& options = {});
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  // Version, loaded case and model, and whether an inversion runs. The daemon always answers it.
  Result<DaemonStatus> status();

  // How the daemon fares, for people and monitors: session, counts, latencies, journal, memory. The
  // daemon always answers it. What may be shown follows from field_status() alone.
  Result<wire::DaemonReport> report();

  // Starts a session for all clients and ends the running one. Returns when the model is prepared,
  // with the sizes of the mesh and the times of the preparation. kInvalidArgument: the daemon
  // serves another case; kModelNotReady: it has no model; kUnavailable: also when another client's
  // start came later.
  Result<SessionInfo> start_session(const SessionRequest& request);

  // The undeformed mesh with its node sets, skull and tumour: some MiB.
  Result<BrainModel> model();

  // From now on the daemon pushes updates to this client. If there is a usable update already, the
  // newest one comes at once, and after it the newest error or unusable update since.
  // window: updates that may be under way at once, 1 to Subscription::kMaxWindow. 1 is for a
  // viewer: it gets the newest update whenever it asks, and never one that the daemon knows to be
  // outdated. More is for one that wants every update, and reads at once.
  // choice: what of every field (see Parts). kInvalidArgument names a length outside its range,
  // kEmptySet a region without any node; the subscription before it goes on then.
  Status subscribe(std::uint32_t window = 1, const FieldChoice& choice = {});

  // Hands an observation over. Returns when the daemon has accepted it, not when it has been
  // inverted. The receipt tells whether it replaced an older one of the same source that still
  // waited. kInvalidArgument and others: the daemon rejects the observation and names the field.
  // Without a session in it, it is for this client's (see Sessions); kUnavailable when that has
  // ended.
  Result<ObservationReceipt> submit(const Observation& observation);

  // kUnavailable when the session that this client started has ended, as far as it has been told:
  // subscribers are told at once. Ok for a client that has started none.
  Status session_status() const;

  // The next pushed update in order of arrival: an iterate, a final update (Update::final) of any
  // quality, or the error that an observation ended in. Only Update::usable() ones may be shown.
  // With a window of 1, one that had to wait here is first confirmed to be the newest.
  // kUnavailable when none arrives within the timeout, and at once when the connection is lost.
  // The daemon's own error when it refuses to renew the subscription: after a restart with another
  // model the choice may hold no node.
  Result<UpdateMessage> next_update(std::chrono::milliseconds timeout);

  // The newest usable update of the running session among those that next_update() has returned.
  // Neither errors, iterates and unusable updates nor a lost connection replace it; the start of
  // another session does. Empty before the first one.
  const std::optional<UpdateMessage>& latest_usable() const;

  // Whether that field may be shown as current, now.
  FieldStatus field_status() const;

  // What the daemon last said of its session; empty before subscribe().
  const std::optional<SessionState>& session_state() const;

 private:
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::client
