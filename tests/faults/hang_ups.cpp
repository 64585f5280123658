// SPDX-License-Identifier: GPL-3.0-or-later
// Peers that close while the daemon has much of them unread, with a heartbeat behind it: what ended
// the process inside libzmq (issue 4841). With keys and without.
#include <zmq.h>

#include <chrono>
#include <csignal>
#include <deque>
#include <optional>
#include <string>
#include <thread>

#include "common/wire/frame.hpp"
#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"
#include "tests/support/zmtp_peer.hpp"

namespace brainshift::faults {
namespace {

using std::chrono::milliseconds;
using test_support::port_of;
using test_support::ZmtpPeer;

// A client of libzmq that asks, reads no answer, and hangs up at once when it goes.
class RudeClient {
 public:
  RudeClient(void* context, const DaemonProcess& daemon, int heartbeat_ms)
      : socket_(zmq_socket(context, ZMQ_DEALER)) {
    set(ZMQ_LINGER, 0);
    set(ZMQ_SNDTIMEO, 5000);
    set(ZMQ_RCVTIMEO, 5000);
    set(ZMQ_HEARTBEAT_IVL, heartbeat_ms);
    if (const auto& keys = daemon.keys()) {
      set(ZMQ_CURVE_SERVERKEY, keys->server_public_key);
      set(ZMQ_CURVE_PUBLICKEY, keys->public_key);
      set(ZMQ_CURVE_SECRETKEY, keys->secret_key);
    }
    zmq_connect(socket_, daemon.endpoint().c_str());
  }
  ~RudeClient() { zmq_close(socket_); }
  RudeClient(const RudeClient&) = delete;
  RudeClient& operator=(const RudeClient&) = delete;

  // False: not within 5 s.
  bool greeted() { return ask(1) && zmq_recv(socket_, nullptr, 0, 0) >= 0; }
  bool ask(int count) {
    const std::string request = wire::encode_frame(wire::MessageType::kReportRequest, 1, {});
    bool sent = true;
    for (int i = 0; i < count; ++i) {
      sent = zmq_send(socket_, request.data(), request.size(), 0) >= 0 && sent;
    }
    return sent;
  }

 private:
  void set(int option, int value) { zmq_setsockopt(socket_, option, &value, sizeof value); }
  void set(int option, const std::string& text) {
    zmq_setsockopt(socket_, option, text.c_str(), text.size());
  }
  void* socket_;
};

struct Context {
  void* handle = zmq_ctx_new();
  ~Context() { zmq_ctx_term(handle); }
};

struct Counts {
  int connections = 0, aborts = 0, unanswered = 0;
};

void check_it_answers(DaemonProcess& daemon, Counts& counts) {
  counts.aborts += daemon.runs() ? 0 : 1;
  if (daemon.runs()) counts.unanswered += answered_within_s(daemon.endpoint()) > 2.0 ? 1 : 0;
}

// (a) The daemon stands still for 4 s below many that ask and beat; a client's heartbeat of 1 s
// gives up meanwhile.
void stand_still(DaemonProcess& daemon, int count, Counts& counts) {
  constexpr int kAtOnce = 50;
  while (counts.connections < count && daemon.runs()) {
    const Context context;
    std::deque<RudeClient> clients;
    for (int i = 0; i < kAtOnce; ++i) clients.emplace_back(context.handle, daemon, 1000).greeted();
    kill(daemon.pid(), SIGSTOP);
    for (int turn = 0; turn < 16; ++turn) {
      for (RudeClient& client : clients) client.ask(1);
      std::this_thread::sleep_for(milliseconds(250));
    }
    kill(daemon.pid(), SIGCONT);
    clients.clear();
    counts.connections += kAtOnce;
    counts.aborts += daemon.runs() ? 0 : 1;
  }
}

// (b) 12 or more requests and a heartbeat in one piece, and the end. With keys a raw peer cannot
// speak: there libzmq beats every millisecond between its requests.
void raw_peers(DaemonProcess& daemon, int count, Counts& counts) {
  const std::string request = wire::encode_frame(wire::MessageType::kReportRequest, 1, {});
  const std::string ping = std::string("\4\7\4PING", 7) + std::string(2, '\0');
  for (; counts.connections < count && daemon.runs(); ++counts.connections) {
    if (daemon.keys()) {
      const Context context;
      RudeClient client(context.handle, daemon, 1);
      client.greeted();
      client.ask(12 + counts.connections % 40);
      std::this_thread::sleep_for(milliseconds(1));
      continue;
    }
    ZmtpPeer peer(port_of(daemon.endpoint()));
    if (!peer.shake_hands()) continue;
    std::string all;
    for (int k = 0; k < 12 + counts.connections % 40; ++k) {
      all += std::string(1, '\0') + static_cast<char>(request.size()) + request;
    }
    peer.send_bytes(all + ping);
  }
}

// (c) An ordinary client with 30 or more requests under way closes.
void busy_clients(DaemonProcess& daemon, int count, Counts& counts) {
  for (; counts.connections < count && daemon.runs(); ++counts.connections) {
    const Context context;
    RudeClient client(context.handle, daemon, 1000);
    client.greeted();
    client.ask(30 + counts.connections % 40);
  }
}

}  // namespace

void run_hang_ups(const Settings& settings, Tally& tally) {
  for (const bool keys : {false, true}) {
    DaemonOptions options{.model = settings.model, .folder = settings.work, .keys = keys};
    options.more = "limits: {connections: 64}\n";
    DaemonProcess daemon(options);
    const std::string with = keys ? " with keys" : " without keys";
    const auto part = [&](const char* name, auto&& run) {
      Counts counts;
      run(daemon, settings.count, counts);
      // With keys nobody but the holder of one is answered, and its status.
      if (!keys) check_it_answers(daemon, counts);
      const std::string what = std::string(name) + with;
      tally.at_least("connections: " + what, counts.connections, settings.count);
      tally.equals("aborts: " + what, counts.aborts, 0);
      tally.equals("no answer within 2 s afterwards: " + what, counts.unanswered, 0);
    };
    part("a stop of 4 s", stand_still);
    part("requests and a heartbeat and the end", raw_peers);
    part("30 requests under way", busy_clients);
    tally.equals("ends when told to" + with, daemon.end(SIGTERM), 0);
  }
}

}  // namespace brainshift::faults
