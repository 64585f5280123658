// SPDX-License-Identifier: GPL-3.0-or-later
// The whole of it runs in tests/integration/test_bridge.py.
#include "client/tools/bridge/bridge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

std::string refusal(const BridgeOptions& options) {
  const auto bridge = Bridge::open(options, [](const std::string&) {});
  return bridge ? "" : bridge.error().message;
}

BridgeOptions quiet() {
  BridgeOptions options;
  options.listen.port = 0;
  return options;
}

TEST(Bridge, ListensOnAPortOfItsOwnAndEndsWhenToldTo) {
  BridgeOptions options = quiet();
  options.endpoint = "tcp://127.0.0.1:1";  // nobody
  const auto bridge = Bridge::open(options, [](const std::string&) {}).value();
  EXPECT_GT(bridge->address().port, 0);
  EXPECT_TRUE(is_loopback(bridge->address()));
  bridge->stop();
  EXPECT_TRUE(bridge->run());
}

TEST(Bridge, AnEndpointThatIsNoneEndsIt) {
  BridgeOptions options = quiet();
  options.endpoint = "no endpoint";
  const auto bridge = Bridge::open(options, [](const std::string&) {}).value();
  const Status status = bridge->run();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kInvalidArgument);
}

TEST(Bridge, RefusesOptionsThatDoNotBelongTogether) {
  BridgeOptions options = quiet();
  options.from = Address{"127.0.0.1", 18944};
  EXPECT_THAT(refusal(options), HasSubstr("say what of it to use"));
  options.inbox.tumour_device = "Tumour";
  EXPECT_EQ(refusal(options), "");
  options.from->port = 0;
  EXPECT_THAT(refusal(options), HasSubstr("1 to 65535"));

  options = quiet();
  options.inbox.seeds = "seeds.csv";
  EXPECT_THAT(refusal(options), HasSubstr("--from"));
  options.from = Address{"127.0.0.1", 18944};
  EXPECT_THAT(refusal(options), HasSubstr("--registration is required"));
  options.inbox.registration = "nowhere.txt";
  EXPECT_THAT(refusal(options), HasSubstr("nowhere.txt"));
  options.inbox.contours = "contours.csv";
  EXPECT_THAT(refusal(options), HasSubstr("at most one"));

  options = quiet();
  options.inbox.landmarks_after = "F";
  EXPECT_THAT(refusal(options), HasSubstr("both or none"));
  options = quiet();
  options.inbox.sd_mm = 0.0;
  EXPECT_THAT(refusal(options), HasSubstr("--sd-mm 0"));
  options = quiet();
  options.inbox.sweep_gap_s = -1.0;
  EXPECT_THAT(refusal(options), HasSubstr("--sweeps -1"));
}

TEST(Bridge, APortThatIsTakenIsNamed) {
  const auto first = Bridge::open(quiet(), [](const std::string&) {}).value();
  BridgeOptions second = quiet();
  second.listen = first->address();
  EXPECT_THAT(refusal(second), HasSubstr("cannot listen on " + to_string(first->address())));
  second.listen = {"192.0.2.1", 0};  // reserved for documents: no address of this computer
  EXPECT_THAT(refusal(second), HasSubstr("192.0.2.1"));
}

}  // namespace
}  // namespace brainshift::client
