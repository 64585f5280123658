// SPDX-License-Identifier: GPL-3.0-or-later
// Who is admitted, and what is accepted of whom: a real router with keys over tcp.
#include <gmock/gmock.h>

#include <chrono>
#include <cstdio>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "client/lib/client.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/server/transport_fixture.hpp"

namespace brainshift::server {
namespace {

using client::Client;
using client::ClientKeys;
using client::ClientOptions;
using std::chrono::milliseconds;
using testing::HasSubstr;

struct Pair {
  std::string public_key = std::string(40, '\0');
  std::string secret_key = std::string(40, '\0');
};

Pair new_pair() {
  char public_key[41];
  char secret_key[41];
  EXPECT_EQ(zmq_curve_keypair(public_key, secret_key), 0);
  return {public_key, secret_key};
}

using Prepare = std::function<void(zmq::socket_t&)>;

Prepare with_keys(const std::string& server, const Pair& own) {
  return [=](zmq::socket_t& socket) {
    socket.set(zmq::sockopt::curve_serverkey, server);
    socket.set(zmq::sockopt::curve_publickey, own.public_key);
    socket.set(zmq::sockopt::curve_secretkey, own.secret_key);
  };
}

Prepare with_password() {
  return [](zmq::socket_t& socket) {
    socket.set(zmq::sockopt::plain_username, std::string("admin"));
    socket.set(zmq::sockopt::plain_password, std::string("admin"));
  };
}

class Admission : public TransportTest {
 protected:
  Admission() {
    for (const Role role : kAllRoles) {
      const std::string name(to_string(role));
      pairs_[role] = new_pair();
      keys_.names.emplace(pairs_[role].public_key, name);
      keys_.roles.emplace(name, role);
    }
    keys_.secret_key = own_.secret_key;
  }

  void serve_with_keys(const Limits& limits = {}) {
    RouterOptions options;
    options.keys = keys_;
    options.limits = limits;
    serve(with_model(), options);
  }

  Prepare as(Role role) const { return with_keys(own_.public_key, pairs_.at(role)); }
  RawPeer peer(Role role) const { return RawPeer(endpoint_, 1000, as(role)); }
  ClientOptions options(const std::string& server, const Pair& own) const {
    return {.request_timeout = milliseconds(1500),
            .keys = ClientKeys{server, own.public_key, own.secret_key}};
  }

  const Pair own_ = new_pair();
  std::map<Role, Pair> pairs_;
  ServerKeys keys_;
};

TEST_F(Admission, EveryRoleIsServedWithItsKey) {
  serve_with_keys();
  for (const Role role : kAllRoles) {
    auto client = value_or_fail(Client::connect(endpoint_, options(own_.public_key, pairs_[role])));
    const auto status = client.status();
    EXPECT_TRUE(status) << to_string(role) << ": " << status.error().message;
  }
}

TEST_F(Admission, ARoleThatDoesNotIncludeARequestIsToldSoAndStaysConnected) {
  serve_with_keys();
  RawPeer owner = peer(Role::kOwner);
  start_session(owner);
  RawPeer viewer = peer(Role::kViewer);
  const Error refused = error_of(viewer.hand_in(landmarks(1), 9));
  EXPECT_EQ(refused.code, ErrorCode::kNotAllowed);
  EXPECT_THAT(refused.message, HasSubstr("the key viewer has the role viewer"));
  EXPECT_TRUE(viewer.is_served());
  RawPeer source = peer(Role::kSource);
  EXPECT_EQ(source.hand_in(landmarks(1)).type, MessageType::kObservationReply);
  const SessionRequest takeover = session_of(kCase, true);
  EXPECT_EQ(error_of(owner.start(takeover)).code, ErrorCode::kNotAllowed);
  RawPeer admin = peer(Role::kAdmin);
  EXPECT_EQ(admin.start(takeover).type, MessageType::kStartSessionReply);
}

// ---------- ten peers times five messages ----------

struct Attempt {
  std::string name;
  MessageType type = MessageType::kObservation;
  std::string payload;
};

std::vector<Attempt> attempts() {
  Observation other_case = landmarks(1);
  other_case.case_id = "someone-else";
  Observation other_frame = landmarks(1);
  other_frame.frame = "lps";
  Observation other_model = landmarks(1);
  other_model.session.model_id = "another-model";
  Observation other_session = landmarks(1);
  other_session.session.session_id += 7;
  const SessionRequest start = session_of("someone-else");
  return {{"other case", MessageType::kObservation, wire::encode(other_case)},
          {"other frame", MessageType::kObservation, wire::encode(other_frame)},
          {"other model", MessageType::kObservation, wire::encode(other_model)},
          {"other session", MessageType::kObservation, wire::encode(other_session)},
          {"start of another case", MessageType::kStartSessionRequest, wire::encode(start)}};
}

struct Caller {
  std::string name;
  bool known = false;
  Prepare prepare;
};

// Whether a handshake succeeds on a socket that connects, as its monitor tells it.
bool handshake_succeeds(const std::string& endpoint, const Prepare& prepare) {
  zmq::context_t context;
  zmq::socket_t socket(context, zmq::socket_type::dealer);
  if (prepare) prepare(socket);
  socket.set(zmq::sockopt::linger, 0);
  constexpr const char* kAddress = "inproc://attempt";
  EXPECT_EQ(
      zmq_socket_monitor(socket.handle(), kAddress,
                         ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_DISCONNECTED |
                             ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                             ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH),
      0);
  zmq::socket_t monitor(context, zmq::socket_type::pair);
  monitor.set(zmq::sockopt::linger, 0);
  monitor.set(zmq::sockopt::rcvtimeo, 10'000);
  monitor.connect(kAddress);
  socket.connect(endpoint);
  zmq::message_t event;
  EXPECT_TRUE(monitor.recv(event)) << "neither admitted nor refused within 10 s";
  std::uint16_t number = 0;
  if (event.size() >= sizeof number) std::memcpy(&number, event.data(), sizeof number);
  return number == ZMQ_EVENT_HANDSHAKE_SUCCEEDED;
}

TEST_F(Admission, NoneOfFiftyPairsIsAdmittedOrAccepted) {
  serve_with_keys();
  RawPeer owner = peer(Role::kOwner);
  start_session(owner);
  const Pair stranger = new_pair();
  const Pair source = pairs_[Role::kSource];
  const std::vector<Caller> callers = {
      {"no keys", false, {}},
      {"a password instead of keys", false, with_password()},
      {"an unknown key", false, with_keys(own_.public_key, stranger)},
      {"a known public key without its secret", false,
       with_keys(own_.public_key, {source.public_key, stranger.secret_key})},
      {"a known key, and another daemon's", false, with_keys(stranger.public_key, source)},
      {"the daemon's public key as its own", false,
       with_keys(own_.public_key, {own_.public_key, stranger.secret_key})},
      {"a viewer", true, as(Role::kViewer)},
      {"a source", true, as(Role::kSource)},
      {"an owner", true, as(Role::kOwner)},
      {"an admin", true, as(Role::kAdmin)}};
  int pairs = 0;
  int admitted = 0;
  int accepted = 0;
  int told = 0;
  for (const Caller& caller : callers) {
    const bool connects = handshake_succeeds(endpoint_, caller.prepare);
    EXPECT_EQ(connects, caller.known) << caller.name;
    for (const Attempt& attempt : attempts()) {
      ++pairs;
      if (!caller.known) {
        // Nothing that it sends goes anywhere without a handshake.
        admitted += connects ? 1 : 0;
        continue;
      }
      RawPeer peer(endpoint_, 1000, caller.prepare);
      const Received reply = peer.ask(attempt.type, attempt.payload, 5);
      EXPECT_EQ(reply.type, MessageType::kErrorReply) << caller.name << ", " << attempt.name;
      EXPECT_EQ(reply.request_id, 5u);
      accepted += reply.type == MessageType::kErrorReply ? 0 : 1;
      told += reply.type == MessageType::kErrorReply ? 1 : 0;
    }
  }
  std::printf("%d pairs: %d strangers admitted, %d messages accepted, %d told why not\n", pairs,
              admitted, accepted, told);
  EXPECT_EQ(pairs, 50);
  EXPECT_EQ(admitted, 0);
  EXPECT_EQ(accepted, 0);
  EXPECT_EQ(told, 20);
  EXPECT_EQ(renew(owner, {1, 1, 0}).newest_update, 0u) << "nothing reached the session";
}

// ---------- what a client is told ----------

TEST_F(Admission, AClientThatIsNotAdmittedIsToldWhatMayBeTheReason) {
  serve_with_keys();
  const struct {
    const char* who;
    ClientOptions options;
    const char* says;
  } rows[] = {
      {"another daemon's key", options(new_pair().public_key, pairs_[Role::kSource]), "key"},
      {"an unknown key", options(own_.public_key, new_pair()), "allow-list"},
      {"no keys", {.request_timeout = milliseconds(1500)}, "keys"}};
  for (const auto& row : rows) {
    SCOPED_TRACE(row.who);
    auto client = value_or_fail(Client::connect(endpoint_, row.options));
    EXPECT_THAT(refusal_of(client.status(), ErrorCode::kUnavailable), HasSubstr(row.says));
  }
}

TEST_F(Admission, AClientRefusesATextThatIsNoKey) {
  serve_with_keys();
  Pair own = pairs_[Role::kSource];
  own.secret_key.pop_back();
  EXPECT_THAT(
      refusal_of(Client::connect(endpoint_, options(own_.public_key, own)),
                 ErrorCode::kInvalidArgument),
      testing::AllOf(HasSubstr("keys.secret_key"), testing::Not(HasSubstr(own.secret_key))));
}

// ---------- limits ----------

TEST_F(Admission, ConnectionsOfAKeyBeyondItsLimitAreToldSoUntilOneLeaves) {
  Limits limits;
  limits.connections = 2;
  serve_with_keys(limits);
  RawPeer first = peer(Role::kViewer);
  EXPECT_TRUE(first.is_served());
  RawPeer third = peer(Role::kViewer);
  {
    RawPeer second = peer(Role::kViewer);
    EXPECT_TRUE(second.is_served());
    EXPECT_EQ(error_of(third.ask(MessageType::kStatusRequest)).code, ErrorCode::kUnavailable);
    RawPeer other = peer(Role::kSource);
    EXPECT_TRUE(other.is_served());
  }
  EXPECT_TRUE(eventually([&] { return third.is_served(); }));
}

TEST_F(Admission, ObservationsBeyondTheLimitAreRefusedAndTheConnectionStays) {
  Limits limits;
  limits.observations_per_s = 1;
  serve_with_keys(limits);
  RawPeer owner = peer(Role::kOwner);
  start_session(owner);
  EXPECT_EQ(owner.hand_in(landmarks(1)).type, MessageType::kObservationReply);
  const Error error = error_of(owner.hand_in(landmarks(2)));
  EXPECT_EQ(error.code, ErrorCode::kUnavailable);
  EXPECT_THAT(error.message, HasSubstr("more than 1 observations a second"));
}

}  // namespace
}  // namespace brainshift::server
