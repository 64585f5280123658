// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "client/lib/client.hpp"
#include "client/lib/client_keys.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/client/lib/fake_daemon.hpp"

namespace brainshift::client {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;
using wire::encode;
using wire::encode_frame;
using wire::Frame;
using wire::MessageType;

constexpr milliseconds kShort(150);

Client connect(const std::string& endpoint, milliseconds timeout = kPatience) {
  return connect_to(endpoint, {.request_timeout = timeout, .session_timeout = timeout});
}

std::string status_reply(std::uint64_t id, const std::string& version = "1.2.3") {
  DaemonStatus status;
  status.version = version;
  return encode_frame(MessageType::kStatusReply, id, encode(status));
}

std::string update_frame(std::uint64_t sequence, bool final = true,
                         Quality quality = Quality::kNotJudged) {
  UpdateMessage message = small_update(sequence, quality);
  if (quality == Quality::kUnusable) {
    message.update.estimate.quality.flags.set(QualityFlag::kInvertedElements);
  }
  message.update.final = final;
  return encode_frame(MessageType::kUpdate, 0, encode(message));
}

template <typename T>
void expect_error(const Result<T>& result, ErrorCode code, const std::string& text) {
  EXPECT_THAT(refusal_of(result, code), HasSubstr(text));
}

TEST(Client, EveryRequestReachesTheDaemonAndItsReplyComesBack) {
  FakeDaemon daemon([](const Frame& request) -> Answers {
    const auto reply = [&](MessageType type, const std::string& payload) -> Answers {
      return {encode_frame(type, request.request_id, payload)};
    };
    switch (request.type) {
      case MessageType::kStatusRequest: return {status_reply(request.request_id)};
      case MessageType::kStartSessionRequest: {
        SessionInfo info;
        info.model_id = wire::decode_session_request(request.payload).value().case_id;
        return reply(MessageType::kStartSessionReply, encode(info));
      }
      case MessageType::kModelRequest: {
        BrainModel model;
        model.case_id = "colin27";
        model.mesh.nodes = Points::Random(3, 1000);
        return reply(MessageType::kModelReply, wire::encode(model));
      }
      case MessageType::kSubscribeRequest:
        return reply(MessageType::kSessionState, wire::encode(SessionState()));
      case MessageType::kObservation: {
        const auto observation = wire::decode_observation(request.payload).value();
        return reply(MessageType::kObservationReply,
                     encode(ObservationReceipt{observation.sequence, true}));
      }
      default: ADD_FAILURE() << "unexpected request"; return {};
    }
  });
  Client client = connect(daemon.endpoint());
  EXPECT_EQ(client.status().value().version, "1.2.3");
  EXPECT_EQ(client.start_session({.case_id = "case 7"}).value().model_id, "case 7");
  EXPECT_EQ(client.model().value().mesh.num_nodes(), 1000);
  EXPECT_TRUE(client.subscribe());
  Observation observation;
  observation.sequence = 42;
  observation.body = TumourBoundary{Points::Random(3, 200), 0.51};
  const auto receipt = value_or_fail(client.submit(observation));
  EXPECT_EQ(receipt.observation_sequence, 42u);
  EXPECT_TRUE(receipt.replaced_pending);
}

TEST(Client, AnErrorReplyBecomesTheCallersError) {
  FakeDaemon daemon([](const Frame& request) -> Answers {
    return {encode_frame(MessageType::kErrorReply, request.request_id,
                         wire::encode(Error{ErrorCode::kModelNotReady, "no model is loaded"}))};
  });
  Client client = connect(daemon.endpoint());
  expect_error(client.model(), ErrorCode::kModelNotReady, "no model is loaded");
}

TEST(Client, AComplaintAboutAnUnreadableRequestIsItsAnswer) {
  FakeDaemon daemon([](const Frame&) -> Answers {
    return {encode_frame(MessageType::kErrorReply, 0,
                         wire::encode(Error{ErrorCode::kProtocol, "frame CRC-32"}))};
  });
  Client client = connect(daemon.endpoint());
  expect_error(client.status(), ErrorCode::kProtocol, "frame CRC-32");
}

TEST(Client, LateRepliesOfTimedOutRequestsAreIgnored) {
  FakeDaemon daemon([](const Frame& request) -> Answers {
    if (request.request_id == 1) return {};
    return {status_reply(1, "late"), status_reply(request.request_id, "in time")};
  });
  Client impatient = connect(daemon.endpoint(), kShort);
  expect_error(impatient.status(), ErrorCode::kUnavailable, daemon.endpoint());
  // The second request may be slow on a loaded machine; ask until it is not.
  Result<DaemonStatus> status = impatient.status();
  for (int i = 0; i < 50 && !status; ++i) status = impatient.status();
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(status->version, "in time");
}

TEST(Client, AReplyToARequestThatWasNeverMadeIsRefused) {
  FakeDaemon daemon(
      [](const Frame& request) -> Answers { return {status_reply(request.request_id + 7)}; });
  Client client = connect(daemon.endpoint());
  expect_error(client.status(), ErrorCode::kProtocol, "never made");
}

TEST(Client, MalformedRepliesAreRefusedNamingTheEndpoint) {
  std::string damaged = status_reply(1);
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  for (const std::string& message : {std::string(), std::string("junk"), damaged,
                                     status_reply(1).substr(0, 30), FakeDaemon::kMultipart}) {
    FakeDaemon daemon([&](const Frame&) -> Answers { return {message}; });
    Client client = connect(daemon.endpoint());
    expect_error(client.status(), ErrorCode::kProtocol, daemon.endpoint());
  }
}

TEST(Client, AReplyOfAnotherTypeOrWithABadPayloadIsRefused) {
  FakeDaemon daemon([](const Frame& request) -> Answers {
    if (request.type == MessageType::kModelRequest) return {status_reply(request.request_id)};
    return {encode_frame(MessageType::kStatusReply, request.request_id, "\x0a\xff")};
  });
  Client client = connect(daemon.endpoint());
  expect_error(client.model(), ErrorCode::kProtocol, "type 2, must be 6");
  expect_error(client.status(), ErrorCode::kProtocol, "StatusReply.version");
}

TEST(Client, SilenceEndsAtTheTimeout) {
  FakeDaemon daemon([](const Frame&) -> Answers { return {}; });
  Client client = connect(daemon.endpoint(), kShort);
  const auto start = std::chrono::steady_clock::now();
  expect_error(client.status(), ErrorCode::kUnavailable, daemon.endpoint());
  const auto elapsed = std::chrono::steady_clock::now() - start;
  EXPECT_GE(elapsed, kShort);
  EXPECT_LT(elapsed, 10 * kShort);
}

TEST(Client, AnEndpointWithoutDaemonIsUnavailableWithinTheTimeout) {
  std::string endpoint;
  {
    FakeDaemon daemon([](const Frame&) -> Answers { return {}; });
    endpoint = daemon.endpoint();
  }
  Client client = connect(endpoint, kShort);
  const auto start = std::chrono::steady_clock::now();
  expect_error(client.status(), ErrorCode::kUnavailable, "no daemon at " + endpoint);
  EXPECT_LT(std::chrono::steady_clock::now() - start, 10 * kShort);
}

TEST(Client, BadEndpointsAndOptionsAreRefused) {
  for (const char* endpoint : {"", "nonsense", "tcp://", "tcp://127.0.0.1", "smoke://signals:1"}) {
    expect_error(Client::connect(endpoint), ErrorCode::kInvalidArgument, "endpoint");
  }
  for (const int bad : {0, -1}) {
    const milliseconds value(bad);
    expect_error(Client::connect("tcp://127.0.0.1:1", {.request_timeout = value}),
                 ErrorCode::kInvalidArgument, "request_timeout");
    expect_error(Client::connect("tcp://127.0.0.1:1", {.session_timeout = value}),
                 ErrorCode::kInvalidArgument, "session_timeout");
    expect_error(Client::connect("tcp://127.0.0.1:1", {.heartbeat_interval = value}),
                 ErrorCode::kInvalidArgument, "heartbeat_interval");
  }
}

TEST(Client, UpdatesBetweenRepliesAreKeptInOrder) {
  FakeDaemon daemon([](const Frame& request) -> Answers {
    const std::uint64_t id = request.request_id;
    return {update_frame(10 * id + 1, false), update_frame(10 * id + 2), status_reply(id),
            update_frame(10 * id + 3)};
  });
  Client client = connect(daemon.endpoint());
  ASSERT_TRUE(client.status());
  ASSERT_TRUE(client.status());
  for (const std::uint64_t expected : {11, 12, 13, 21, 22, 23}) {
    const auto message = value_or_fail(client.next_update(kPatience));
    EXPECT_EQ(message.update.sequence, expected);
    EXPECT_EQ(message.update.final, expected % 10 != 1);
    EXPECT_EQ(message.update.estimate.displacement,
              Points::Constant(3, 2, static_cast<double>(expected)));
  }
  expect_error(client.next_update(milliseconds(1)), ErrorCode::kUnavailable, daemon.endpoint());
}

TEST(Client, KeepsTheLatestUsableFieldOfWhatItHandedOut) {
  FakeDaemon daemon([](const Frame& request) -> Answers {
    const std::uint64_t id = request.request_id;
    if (request.type == MessageType::kStartSessionRequest) {
      return {encode_frame(MessageType::kStartSessionReply, id, encode(SessionInfo{}))};
    }
    return {update_frame(1, true, Quality::kGood), update_frame(2, true, Quality::kUnusable),
            update_frame(3, false), status_reply(id)};
  });
  Client client = connect(daemon.endpoint());
  ASSERT_TRUE(client.status());
  EXPECT_FALSE(client.latest_usable()) << "queued, not handed out yet";
  for (const std::uint64_t sequence : {1, 2, 3}) {
    const auto message = value_or_fail(client.next_update(kPatience));
    EXPECT_EQ(message.update.sequence, sequence);
    EXPECT_EQ(message.update.usable(), sequence == 1);
    ASSERT_TRUE(client.latest_usable());
    EXPECT_EQ(client.latest_usable()->update.estimate.displacement, Points::Constant(3, 2, 1.0));
  }
  expect_error(client.next_update(milliseconds(1)), ErrorCode::kUnavailable, daemon.endpoint());
  EXPECT_TRUE(client.latest_usable());
  ASSERT_TRUE(client.start_session({.case_id = "c"}));
  EXPECT_FALSE(client.latest_usable()) << "of the session before";
}

TEST(Client, UpdatesThatWaitEndWithTheirSession) {
  FakeDaemon daemon([](const Frame& request) -> Answers {
    const auto of_session = [](std::uint64_t session) {
      UpdateMessage message = small_update(1, Quality::kGood);
      message.session_id = session;
      message.boot_id = 7;
      return encode_frame(MessageType::kUpdate, 0, encode(message));
    };
    if (request.type != MessageType::kStartSessionRequest) return {};
    SessionInfo info;
    info.boot_id = 7;
    info.session_id = request.request_id;
    return {of_session(request.request_id - 1),
            encode_frame(MessageType::kStartSessionReply, request.request_id, encode(info)),
            of_session(request.request_id)};
  });
  Client client = connect(daemon.endpoint());
  ASSERT_TRUE(client.start_session({.case_id = "c"}));
  ASSERT_TRUE(client.start_session({.case_id = "c", .takeover = true}));
  EXPECT_EQ(client.next_update(kPatience).value().session_id, 2u);
  EXPECT_EQ(client.latest_usable()->session_id, 2u);
}

TEST(Client, WhoStartedASessionObservesForNoOther) {
  std::vector<SessionKey> observed;
  FakeDaemon daemon([&](const Frame& request) -> Answers {
    const std::uint64_t id = request.request_id;
    SessionState other;
    other.session = {7, 2, "m"};
    switch (request.type) {
      case MessageType::kStartSessionRequest: {
        SessionInfo info;
        info.boot_id = 7;
        info.session_id = 1;
        info.model_id = "m";
        return {encode_frame(MessageType::kStartSessionReply, id, encode(info))};
      }
      case MessageType::kObservation:
        observed.push_back(wire::decode_observation(request.payload)->session);
        return {encode_frame(MessageType::kObservationReply, id, encode(ObservationReceipt{}))};
      case MessageType::kSubscribeRequest:
        return {encode_frame(MessageType::kSessionState, id, encode(other))};
      default: return {};
    }
  });
  Observation observation;
  observation.source = "ius";
  observation.body = LandmarkPairs{Points::Ones(3, 3), Points::Ones(3, 3), 0.1};
  Client client = connect(daemon.endpoint());
  ASSERT_TRUE(client.start_session({.case_id = "c"}));
  ASSERT_TRUE(client.submit(observation));
  EXPECT_TRUE(client.session_status());
  ASSERT_TRUE(client.subscribe());
  expect_error(client.submit(observation), ErrorCode::kUnavailable,
               "session 1 has ended: another client has started session 2");
  EXPECT_FALSE(client.session_status());
  Client viewer = connect(daemon.endpoint());
  ASSERT_TRUE(viewer.subscribe());
  ASSERT_TRUE(viewer.submit(observation));
  EXPECT_THAT(observed, testing::ElementsAre(SessionKey{7, 1, "m"}, SessionKey{7, 2, "m"}));
}

TEST(Client, AFieldOfAnotherMeshIsRefused) {
  FakeDaemon daemon([](const Frame& request) -> Answers {
    SessionInfo info;
    info.nodes = 10;
    return {encode_frame(MessageType::kStartSessionReply, request.request_id, encode(info)),
            update_frame(1)};
  });
  Client client = connect(daemon.endpoint());
  ASSERT_TRUE(client.start_session({.case_id = "c"}));
  expect_error(client.next_update(kPatience), ErrorCode::kProtocol,
               "of a mesh of 2 nodes, the model has 10");
  EXPECT_FALSE(client.latest_usable());
}

TEST(Client, ABadUpdateIsReportedByNextUpdateAndNotByTheRequestItMet) {
  FakeDaemon daemon([](const Frame& request) -> Answers {
    return {encode_frame(MessageType::kUpdate, 0, "\xff"), status_reply(request.request_id),
            update_frame(2)};
  });
  Client client = connect(daemon.endpoint());
  ASSERT_TRUE(client.status());
  expect_error(client.next_update(kPatience), ErrorCode::kProtocol, "Update");
  EXPECT_EQ(client.next_update(kPatience).value().update.sequence, 2u);
}

TEST(Client, ADaemonThatDiesWhileACallWaitsIsNoticedBeforeTheTimeout) {
  FakeDaemon daemon([](const Frame&) -> Answers { return {FakeDaemon::kDie}; });
  Client client = connect(daemon.endpoint());
  const auto start = std::chrono::steady_clock::now();
  expect_error(client.start_session({.case_id = "c"}), ErrorCode::kUnavailable,
               "lost the connection");
  EXPECT_LT(std::chrono::steady_clock::now() - start, kPatience / 4);
}

TEST(Client, WorksAgainAfterTheDaemonRestarted) {
  const auto handler = [](const Frame& request) -> Answers {
    return {status_reply(request.request_id)};
  };
  // A local socket: a loopback port could be taken by another test while nobody holds it.
  const test_support::TemporaryFolder folder;
  const std::string endpoint = "ipc://" + (folder / "daemon").string();
  auto daemon = std::make_unique<FakeDaemon>(handler, endpoint);
  Client client = connect(endpoint);
  ASSERT_TRUE(client.status());
  daemon.reset();
  expect_error(client.next_update(kPatience), ErrorCode::kUnavailable, "lost the connection");
  daemon = std::make_unique<FakeDaemon>(handler, endpoint);
  const auto status = value_or_fail(client.status());
  EXPECT_EQ(status.version, "1.2.3");
}

TEST(Client, ARequestAboveThePayloadCapIsRefusedHere) {
  Client client = connect("tcp://127.0.0.1:1", kShort);
  Observation observation;
  observation.body = TumourBoundary{Points::Constant(3, 3'000'000, 1.0), 0.5};
  expect_error(client.submit(observation), ErrorCode::kInvalidArgument, "must be at most 67108864");
}

// ---------- keys ----------

TEST(ClientKeys, ANewPairBelongsTogetherAndIsAnotherEachTime) {
  const auto one = value_or_fail(new_keys());
  const auto other = value_or_fail(new_keys());
  EXPECT_NE(one.secret_key, other.secret_key);
  EXPECT_EQ(public_key_of(one.secret_key).value(), one.public_key);
  EXPECT_EQ(public_key_of(other.secret_key).value(), other.public_key);
}

TEST(ClientKeys, ATextThatIsNoKeyHasNoPublicKey) {
  for (const std::string& none : {std::string(), std::string(39, '0'), std::string(40, '"')}) {
    refusal_of(public_key_of(none), ErrorCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace brainshift::client
