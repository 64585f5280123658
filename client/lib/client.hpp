// SPDX-License-Identifier: Apache-2.0
// Client: how a navigation system talks to brainshiftd. Links no solver.
//
//   auto client = Client::connect("tcp://127.0.0.1:5555");
//   client->subscribe();
//   client->start_session({.case_id = "colin27"});
//   client->submit(observation);
//   auto message = client->next_update(std::chrono::seconds(30));
//
// Not thread-safe: one Client per thread. Every call returns within its timeout with a value or an Error
// (kUnavailable: no daemon; kModelNotReady, kInvalidArgument, ...: the daemon's own answer; kProtocol).
// Updates that arrive while another call waits are queued (bounded; the oldest iterate is dropped first,
// final updates never).
//
// connect() does not wait for the daemon; the first request does. When the daemon goes away while a call
// waits, the call returns kUnavailable at once instead of at its timeout. The connection comes back by
// itself, but the daemon has then forgotten this client: subscribe again.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "common/values/brain_model.hpp"
#include "common/core/error.hpp"
#include "common/values/observation.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

struct ClientOptions {
  std::chrono::milliseconds request_timeout{5000};
  std::chrono::milliseconds session_timeout{600000};  // starting a session may prepare the model
  std::chrono::milliseconds heartbeat_interval{1000};
};

class Client {
 public:
  static Result<Client> connect(const std::string& endpoint, const ClientOptions& options = {});
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  Result<wire::DaemonStatus> status();
  Result<wire::SessionInfo> start_session(const wire::SessionRequest& request);
  Result<BrainModel> model();
  Status subscribe();
  Result<wire::ObservationReceipt> submit(const Observation& observation);
  // Next pushed update (iterate or final) in order of arrival.
  Result<wire::UpdateMessage> next_update(std::chrono::milliseconds timeout);

 private:
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::client
