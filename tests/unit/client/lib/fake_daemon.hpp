// SPDX-License-Identifier: Apache-2.0
// A ROUTER on a loopback port that answers as the test says.
#pragma once

#include <gtest/gtest.h>
#include <zmq.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/lib/client.hpp"
#include "common/wire/frame.hpp"
#include "tests/support/results.hpp"

namespace brainshift::client {

// Long enough for a loaded machine; a test that waits for it has failed.
inline constexpr std::chrono::milliseconds kPatience(20000);

class FakeDaemon {
 public:
  // Messages to send back, in order.
  using Answers = std::vector<std::string>;
  using Handler = std::function<Answers(const wire::Frame& request)>;
  // An answer that makes the daemon close its socket at once, as if it had died.
  inline static const std::string kDie = "die";
  // An answer that is sent in two parts.
  inline static const std::string kMultipart = "multipart";

  explicit FakeDaemon(Handler handler, const std::string& endpoint = "tcp://127.0.0.1:*")
      : handler_(std::move(handler)) {
    socket_ = zmq_socket(context_.get(), ZMQ_ROUTER);
    const int none = 0;
    zmq_setsockopt(socket_, ZMQ_LINGER, &none, sizeof none);
    EXPECT_EQ(zmq_bind(socket_, endpoint.c_str()), 0) << zmq_strerror(errno);
    char bound[128] = {};
    std::size_t size = sizeof bound;
    zmq_getsockopt(socket_, ZMQ_LAST_ENDPOINT, bound, &size);
    endpoint_ = bound;
    thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
  }
  ~FakeDaemon() { stop(); }

  void stop() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }
  const std::string& endpoint() const { return endpoint_; }

 private:
  static std::string receive_part(void* socket) {
    zmq_msg_t part;
    zmq_msg_init(&part);
    zmq_msg_recv(&part, socket, 0);
    std::string bytes(static_cast<const char*>(zmq_msg_data(&part)), zmq_msg_size(&part));
    zmq_msg_close(&part);
    return bytes;
  }

  void serve(const std::stop_token& stop) {
    bool alive = true;
    while (alive && !stop.stop_requested()) {
      zmq_pollitem_t item{socket_, 0, ZMQ_POLLIN, 0};
      if (zmq_poll(&item, 1, 10) <= 0) continue;
      const std::string identity = receive_part(socket_);
      const std::string request = receive_part(socket_);
      const auto frame = wire::decode_frame(request);
      EXPECT_TRUE(frame);
      if (frame) alive = answer(identity, handler_(*frame));
    }
    zmq_close(socket_);
  }

  bool answer(const std::string& identity, const Answers& answers) {
    for (const std::string& message : answers) {
      if (message == kDie) return false;
      zmq_send(socket_, identity.data(), identity.size(), ZMQ_SNDMORE);
      if (message == kMultipart) zmq_send(socket_, "part", 4, ZMQ_SNDMORE);
      zmq_send(socket_, message.data(), message.size(), 0);
    }
    return true;
  }

  Handler handler_;
  std::unique_ptr<void, int (*)(void*)> context_{zmq_ctx_new(), zmq_ctx_term};
  void* socket_ = nullptr;
  std::string endpoint_;
  std::jthread thread_;
};
using Answers = FakeDaemon::Answers;

inline Client connect_to(const std::string& endpoint, const ClientOptions& options) {
  return value_or_fail(Client::connect(endpoint, options));
}

// A field of two nodes, all of whose displacements are the update's number.
inline UpdateMessage small_update(std::uint64_t sequence, Quality quality) {
  UpdateMessage message;
  message.update.sequence = sequence;
  message.update.final = true;
  message.update.estimate.quality.quality = quality;
  message.update.estimate.displacement = Points::Constant(3, 2, static_cast<double>(sequence));
  return message;
}

}  // namespace brainshift::client
