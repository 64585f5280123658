// SPDX-License-Identifier: GPL-3.0-or-later
// Bad messages of many kinds to the daemon, between two observations of a session: no crash, the
// next field has the same bits as without them, and memory stays.
#include <zmq.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "common/wire/convert.hpp"
#include "common/wire/frame.hpp"
#include "tests/faults/daemon_process.hpp"
#include "tests/faults/feed.hpp"
#include "tests/faults/settings.hpp"
#include "tests/support/zmtp_peer.hpp"

namespace brainshift::faults {
namespace {

using test_support::port_of;
using test_support::ZmtpPeer;
using wire::MessageType;
using Parts = std::vector<std::string>;

constexpr int kRounds = 16;        // with a set of connections before it is made anew
constexpr int kSenders = 8;        // the daemon reads each at a bounded rate
constexpr int kBeforeDrain = 128;  // messages to a connection

// Messages that are refused, made from one observation that would be accepted.
class BadMessages {
 public:
  static constexpr std::array<const char*, 9> kKinds = {"random",       "truncated", "huge claim",
                                                        "not a number", "empty",     "wrong type",
                                                        "concatenated", "multipart", "flipped"};

  BadMessages(const Observation& good, std::uint32_t seed) : random_(seed) {
    payload_ = wire::encode(good);
    frame_ = wire::encode_frame(MessageType::kObservation, 7, payload_);
    Observation bad = good;
    std::get<TumourBoundary>(bad.body).points(0, 0) = std::numeric_limits<double>::quiet_NaN();
    not_a_number_ = wire::encode_frame(MessageType::kObservation, 7, wire::encode(bad));
    twice_ = wire::encode_frame(MessageType::kObservation, 7, payload_ + payload_);
    wrong_type_ = wire::encode_frame(MessageType::kObservationReply, 7, payload_);
    huge_ = frame_.substr(0, wire::kHeaderBytes);
    std::memset(huge_.data() + 8, 0xff, 4);  // the payload's size
  }

  Parts next(std::size_t i) {
    switch (i % kKinds.size()) {
      case 0: return {random_bytes(1 + random_() % 300)};
      case 1: return {frame_.substr(0, random_() % frame_.size())};
      case 2: return {huge_};
      case 3: return {not_a_number_};
      case 4: return {""};
      case 5: return {wrong_type_};
      case 6: return {twice_};
      case 7: return {frame_, random_bytes(20), ""};
      default: return {flipped()};
    }
  }

 private:
  std::string random_bytes(std::size_t count) {
    std::string bytes(count, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random_());
    return bytes;
  }
  std::string flipped() {
    std::string bytes = frame_;
    char& byte = bytes[random_() % bytes.size()];
    byte = static_cast<char>(byte ^ (1 << random_() % 8));
    return bytes;
  }

  std::mt19937 random_;
  std::string payload_, frame_, not_a_number_, twice_, wrong_type_, huge_;
};

// A ZeroMQ connection that sends whatever it is given.
class Sender {
 public:
  explicit Sender(const std::string& endpoint) : context_(zmq_ctx_new()) {
    socket_ = zmq_socket(context_, ZMQ_DEALER);
    const int linger = 0, patience_ms = 20000;
    zmq_setsockopt(socket_, ZMQ_LINGER, &linger, sizeof linger);
    zmq_setsockopt(socket_, ZMQ_SNDTIMEO, &patience_ms, sizeof patience_ms);
    zmq_setsockopt(socket_, ZMQ_RCVTIMEO, &patience_ms, sizeof patience_ms);
    zmq_connect(socket_, endpoint.c_str());
  }
  ~Sender() {
    zmq_close(socket_);
    zmq_ctx_term(context_);
  }
  Sender(const Sender&) = delete;
  Sender& operator=(const Sender&) = delete;

  void send(const Parts& parts) {
    for (std::size_t p = 0; p < parts.size(); ++p) {
      const int more = p + 1 < parts.size() ? ZMQ_SNDMORE : 0;
      if (zmq_send(socket_, parts[p].data(), parts[p].size(), more) < 0) {
        throw std::runtime_error("the daemon takes no more messages");
      }
    }
  }
  // Until the answer to a status request sent last has come: everything before it was handled.
  // Returns the number of answers that were no ErrorReply.
  int drain() {
    send({wire::encode_frame(MessageType::kStatusRequest, 99, "")});
    int accepted = 0;
    while (true) {
      zmq_msg_t message;
      zmq_msg_init(&message);
      const int size = zmq_msg_recv(&message, socket_, 0);
      const std::string bytes(static_cast<const char*>(zmq_msg_data(&message)),
                              size > 0 ? static_cast<std::size_t>(size) : 0);
      zmq_msg_close(&message);
      if (size < 0) throw std::runtime_error("the daemon does not answer");
      const auto frame = wire::decode_frame(bytes);
      if (!frame) throw std::runtime_error("the daemon's answer cannot be read");
      if (frame->type == MessageType::kStatusReply) return accepted;
      accepted += frame->type == MessageType::kErrorReply ? 0 : 1;
    }
  }

 private:
  void* context_ = nullptr;
  void* socket_ = nullptr;
};

// The fields of a session: `before` observations, whatever `between` does, and one more of each.
std::vector<Update> fields_of(const std::string& endpoint, const Feed& feed,
                              const std::function<void(const Opened&)>& between) {
  Opened opened = open_session(endpoint, feed, true);
  need(opened.client.subscribe(), "subscribe");
  std::vector<Update> fields;
  for (std::size_t i = 0; i < 2 * feed.sources(); ++i) {
    if (i == feed.sources()) between(opened);
    fields.push_back(answer_to(opened.client, feed.recorded(i)).update);
  }
  return fields;
}

std::vector<Update> undisturbed(const Settings& settings, const Feed& feed) {
  const DaemonProcess daemon({.model = settings.model, .folder = settings.work, .log = false});
  return fields_of(daemon.endpoint(), feed, [](const Opened&) {});
}

// An observation of the running session that the daemon would take.
Observation acceptable(const Feed& feed, const Opened& opened) {
  for (std::size_t i = feed.sources();; ++i) {
    Observation observation = feed.recorded(i);
    if (!std::holds_alternative<TumourBoundary>(observation.body)) continue;
    observation.session = opened.info.key();
    return observation;
  }
}

}  // namespace

void run_bad_messages(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  const auto expected = undisturbed(settings, feed);
  DaemonProcess daemon({.model = settings.model, .folder = settings.work, .log = false});
  Rows rows(settings.work / "bad-messages.csv", "messages,resident_mib");
  int accepted = 0;
  double idle_mib = 0.0, most_mib = 0.0;
  const auto fields = fields_of(daemon.endpoint(), feed, [&](const Opened& opened) {
    idle_mib = daemon.resident_mib();
    BadMessages messages(acceptable(feed, opened), settings.seed);
    for (int sent = 0; sent < settings.count;) {
      std::vector<std::unique_ptr<Sender>> senders;
      for (int i = 0; i < kSenders; ++i) {
        senders.push_back(std::make_unique<Sender>(daemon.endpoint()));
      }
      for (int round = 0; round < kRounds && sent < settings.count; ++round) {
        for (const auto& sender : senders) {
          for (int i = 0; i < kBeforeDrain && sent < settings.count; ++i, ++sent) {
            sender->send(messages.next(static_cast<std::size_t>(sent)));
          }
        }
        for (const auto& sender : senders) accepted += sender->drain();
      }
      senders.clear();
      // Sizes beyond ZeroMQ's own cap end their connection.
      ZmtpPeer liar(port_of(daemon.endpoint()));
      if (liar.shake_hands()) liar.claim_part(std::uint64_t{1} << 62);
      most_mib = std::max(most_mib, daemon.resident_mib());
      rows.add({double(sent), daemon.resident_mib()});
      show_progress("bad messages", sent, settings.count);
    }
  });
  tally.shown("bad messages sent", settings.count);
  tally.equals("crashes", daemon.runs() ? 0 : 1, 0);
  tally.equals("bad messages that were accepted", accepted, 0);
  tally.equals("later fields with other bits than without them", differing(fields, expected), 0);
  tally.cost_at_most("resident memory above idle MiB", most_mib - idle_mib, 64.0);
}

void run_unfinished_messages(const Settings& settings, Tally& tally) {
  const Feed feed(settings.surgery);
  const auto expected = undisturbed(settings, feed);
  DaemonProcess daemon({.model = settings.model, .folder = settings.work, .log = false});
  Rows rows(settings.work / "unfinished.csv", "sent_mib,resident_mib,client_waited_s");
  double idle_mib = 0.0, most_mib = 0.0, slowest_s = 0.0;
  const auto flood = [&](const std::string& bytes_of_a_part, int parts_at_once, double all_mib) {
    ZmtpPeer peer(port_of(daemon.endpoint()));
    bool taken = peer.shake_hands();
    double sent_mib = 0.0;
    while (taken && sent_mib < all_mib) {
      for (int i = 0; taken && i < parts_at_once; ++i) {
        taken = peer.send_part(bytes_of_a_part, true);
        sent_mib += static_cast<double>(bytes_of_a_part.size() + 2) / 1048576.0;
      }
      const double waited_s = answered_within_s(daemon.endpoint());
      slowest_s = std::max(slowest_s, waited_s);
      most_mib = std::max(most_mib, daemon.resident_mib());
      rows.add({sent_mib, daemon.resident_mib(), waited_s});
    }
  };
  const auto fields = fields_of(daemon.endpoint(), feed, [&](const Opened&) {
    idle_mib = daemon.resident_mib();
    // `count`: MiB of parts of 1 MiB; the empty parts take a 16th of that.
    flood(std::string(1 << 20, 'x'), 16, settings.count);
    flood("", 200000, settings.count / 16.0);
    flood(std::string(40, 'x'), 20000, settings.count / 16.0);
  });
  tally.shown("unfinished parts sent MiB", settings.count * (1.0 + 2.0 / 16.0));
  tally.equals("crashes", daemon.runs() ? 0 : 1, 0);
  tally.equals("later fields with other bits than without them", differing(fields, expected), 0);
  tally.cost_at_most("resident memory above idle MiB", most_mib - idle_mib, 64.0);
  tally.at_most("slowest answer to another client s", slowest_s, 2.0);
}

}  // namespace brainshift::faults
