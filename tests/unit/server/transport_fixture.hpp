// SPDX-License-Identifier: GPL-3.0-or-later
// A daemon on a free loopback port, with a fake inversion, and raw sockets that may say anything to
// it.
#pragma once

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <zmq.hpp>

#include "common/wire/convert.hpp"
#include "common/wire/frame.hpp"
#include "server/service/service.hpp"
#include "server/transport/outbox.hpp"
#include "server/transport/router.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/server/fake_session.hpp"
#include "tests/unit/server/sample_values.hpp"

namespace brainshift::server {

using wire::MessageType;

struct Received {
  MessageType type = MessageType::kErrorReply;
  std::uint64_t request_id = 0;
  std::string payload;
};

// A peer that sends whatever bytes it is given.
class RawPeer {
 public:
  // prepare: what else to set before it connects, such as keys.
  explicit RawPeer(const std::string& endpoint, int receive_queue = 1000,
                   const std::function<void(zmq::socket_t&)>& prepare = {})
      : socket_(context_, zmq::socket_type::dealer) {
    if (prepare) prepare(socket_);
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::rcvhwm, receive_queue);
    socket_.set(zmq::sockopt::rcvtimeo, 10000);
    socket_.connect(endpoint);
  }

  void send(const std::string& bytes) { socket_.send(zmq::buffer(bytes)); }
  void send_parts(int parts) {
    for (int i = 0; i < parts; ++i) {
      socket_.send(zmq::str_buffer("part"),
                   i + 1 < parts ? zmq::send_flags::sndmore : zmq::send_flags::none);
    }
  }
  void request(MessageType type, const std::string& payload = {}, std::uint64_t id = 1) {
    send(wire::encode_frame(type, id, payload));
  }
  Received receive() {
    zmq::message_t message;
    if (!socket_.recv(message)) throw std::runtime_error("nothing came within 10 s");
    const auto frame = wire::decode_frame(message.to_string_view());
    if (!frame) throw std::runtime_error("undecodable: " + frame.error().message);
    return {frame->type, frame->request_id, std::string(frame->payload)};
  }
  Received ask(MessageType type, const std::string& payload = {}, std::uint64_t id = 1) {
    request(type, payload, id);
    return receive();
  }
  void observe(const Observation& observation) {
    request(MessageType::kObservation, wire::encode(observation));
  }
  Received hand_in(const Observation& observation, std::uint64_t id = 1) {
    return ask(MessageType::kObservation, wire::encode(observation), id);
  }
  Received start(const SessionRequest& request, std::uint64_t id = 1) {
    return ask(MessageType::kStartSessionRequest, wire::encode(request), id);
  }
  bool is_served() { return ask(MessageType::kStatusRequest).type == MessageType::kStatusReply; }
  // Asks again every 100 ms; false after 10 s.
  bool keeps_asking_until_answered() {
    for (int attempt = 0; attempt < 100; ++attempt) {
      request(MessageType::kStatusRequest);
      zmq::pollitem_t item{socket_.handle(), 0, ZMQ_POLLIN, 0};
      if (zmq_poll(&item, 1, 100) == 1) return receive().type == MessageType::kStatusReply;
    }
    return false;
  }

 private:
  zmq::context_t context_;
  zmq::socket_t socket_;
};

inline Error error_of(const Received& received) {
  EXPECT_EQ(received.type, MessageType::kErrorReply);
  return wire::decode_error(received.payload);
}

// A session of method paper under the boundary with contact.
inline SessionRequest session_of(const std::string& case_id = kCase, bool takeover = false) {
  SessionRequest request;
  request.case_id = case_id;
  request.method = Method::kPaper;
  request.takeover = takeover;
  return request;
}

// Waits for a condition for at most 10 s.
template <typename Condition>
bool eventually(const Condition& holds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
  }
  return true;
}

class TransportTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { spdlog::set_level(spdlog::level::off); }
  ~TransportTest() override { stop(); }

  void serve(ServiceOptions service_options, RouterOptions router_options = {}) {
    router_options.endpoint = "tcp://127.0.0.1:*";
    auto router = value_or_fail(Router::bind(router_options));
    endpoint_ = router.endpoint();
    router_ = std::make_shared<Router>(std::move(router));
    service_ = std::make_unique<Service>(std::move(service_options), outbox_);
    thread_ = std::thread([this] { run_status_ = router_->run(*service_, outbox_, stop_fd_); });
  }

  void stop() {
    if (!thread_.joinable()) return;
    const std::uint64_t one = 1;
    ASSERT_EQ(write(stop_fd_, &one, sizeof one), static_cast<ssize_t>(sizeof one));
    thread_.join();
    service_->stop();
    EXPECT_TRUE(run_status_.has_value()) << run_status_.error().message;
    close(stop_fd_);
  }

  static ServiceOptions with_model(int nodes = 5) {
    ServiceOptions options;
    options.version = "1.2.3";
    options.model = small_model();
    options.boot_id = kBootId;
    options.make_model = [nodes](const SessionRequest& request, const auto&) {
      return fake_session(std::make_unique<FakeInverter>(nodes), request);
    };
    return options;
  }
  // Sessions whose inversion is this.
  static ServiceOptions with_inverter(FakeInverter::Update update) {
    ServiceOptions options = with_model();
    options.make_model = [update](const SessionRequest& request, const auto&) {
      return fake_session(std::make_unique<FakeInverter>(update), request);
    };
    return options;
  }
  // One whose second inversion fails.
  static ServiceOptions with_a_failure() {
    return with_inverter([](int call, const SparseData& data, const auto&, auto& out) -> Status {
      if (call == 2) return fail(ErrorCode::kNotConverged, "no luck");
      return follow_the_data(data, out, 4);
    });
  }
  // An inversion that ends when it is told to, and not before.
  static Status wait_for_stop(const std::stop_token& stop) {
    std::promise<void> stopped;
    const std::stop_callback wake(stop, [&] { stopped.set_value(); });
    stopped.get_future().wait();
    return fail(ErrorCode::kNotConverged, "stopped");
  }
  // With a journal in that folder, opened by `open`.
  static ServiceOptions with_journal(const std::filesystem::path& folder, OpenSink open) {
    ServiceOptions options = with_model();
    options.journal_dir = folder;
    options.open_journal = std::move(open);
    return options;
  }
  static Result<std::unique_ptr<RecordSink>> disk_full(const std::filesystem::path&,
                                                       const JournalMeta&) {
    return fail(ErrorCode::kWriteFailed, "j.surgery: disk full");
  }

  static ServiceOptions without_model() {
    ServiceOptions options;
    options.version = "1.2.3";
    return options;
  }

  static void start_session(RawPeer& peer) {
    Received reply = peer.start(session_of());
    while (reply.type == MessageType::kSessionState) reply = peer.receive();
    ASSERT_EQ(reply.type, MessageType::kStartSessionReply);
  }

  // With room for many updates, so that none has to be acknowledged.
  static void subscribe(RawPeer& peer, std::uint32_t window = Subscription::kMaxWindow) {
    ASSERT_EQ(renew(peer, {1, window, 0}).session.boot_id, kBootId);
  }

  // The state that answers a renewal; updates and pushed states on the way are lost.
  static SessionState renew(RawPeer& peer, const Subscription& subscription) {
    peer.request(MessageType::kSubscribeRequest, wire::encode(subscription), 7);
    Received received = peer.receive();
    while (received.type != MessageType::kSessionState || received.request_id != 7) {
      received = peer.receive();
    }
    return value_or_fail(wire::decode_session_state(received.payload));
  }

  // A session whose updates `peer` receives.
  static void begin(RawPeer& peer) {
    start_session(peer);
    subscribe(peer);
  }
  // The same, with the update of one observation.
  static void begin_with_update(RawPeer& peer, std::uint64_t sequence) {
    begin(peer);
    ASSERT_EQ(answer(peer, landmarks(sequence)).update.observation_sequence, sequence);
  }

  static Received next(RawPeer& peer, MessageType type) {
    Received received = peer.receive();
    while (received.type != type) received = peer.receive();
    return received;
  }
  static UpdateMessage next_update(RawPeer& peer) {
    return value_or_fail(wire::decode_update(next(peer, MessageType::kUpdate).payload));
  }
  // What the peer receives for its observation.
  static UpdateMessage answer(RawPeer& peer, const Observation& observation) {
    peer.observe(observation);
    return next_update(peer);
  }

  void expect_alive() { EXPECT_TRUE(RawPeer(endpoint_).is_served()); }

  std::string endpoint_;
  std::shared_ptr<Router> router_;

 private:
  int stop_fd_ = eventfd(0, EFD_CLOEXEC);
  Outbox outbox_;
  std::unique_ptr<Service> service_;
  std::thread thread_;
  Status run_status_;
};

}  // namespace brainshift::server
