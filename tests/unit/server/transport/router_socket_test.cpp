// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/transport/router_socket.hpp"

#include <gtest/gtest.h>
#include <pthread.h>

#include <csignal>
#include <thread>

#include "server/transport/uninterrupted.hpp"

namespace brainshift::server {
namespace {

// A signal arrives at this thread again and again, as SIGTERM does at that of the daemon once.
class Interrupted {
 public:
  Interrupted() {
    struct sigaction ignored {};
    ignored.sa_handler = [](int) {};
    sigaction(SIGUSR1, &ignored, &before_);
    thread_ = std::jthread([target = pthread_self()](const std::stop_token& stop) {
      while (!stop.stop_requested()) pthread_kill(target, SIGUSR1);
    });
  }
  ~Interrupted() {
    thread_.request_stop();
    thread_.join();
    sigaction(SIGUSR1, &before_, nullptr);
  }

 private:
  struct sigaction before_ {};
  std::jthread thread_;
};

TEST(RouterSocket, ASignalIsNoFailure) {
  zmq::context_t context;
  RouterSocket router(context, {});
  zmq::socket_t peer(context, zmq::socket_type::dealer);
  peer.connect("ipc://@" + router.bind());
  const auto send = [&] { return peer.send(zmq::str_buffer("hello"), zmq::send_flags::none); };
  const auto receive = [&] {
    zmq::message_t answer;
    return peer.recv(answer, zmq::recv_flags::none);
  };
  const Interrupted interrupted;
  for (int i = 0; i < 300; ++i) {
    uninterrupted(send);
    std::optional<Incoming> incoming;
    while (!incoming) ASSERT_NO_THROW(incoming = router.receive());
    EXPECT_EQ(incoming->parts, 1);
    const auto bytes = std::make_shared<const std::string>("world");
    ASSERT_NO_THROW(EXPECT_EQ(router.send(incoming->peer, bytes), Sent::kYes));
    uninterrupted(receive);
  }
}

}  // namespace
}  // namespace brainshift::server
