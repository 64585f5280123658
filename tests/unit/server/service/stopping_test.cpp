// SPDX-License-Identifier: GPL-3.0-or-later
// The end of the daemon.
#include <gtest/gtest.h>

#include <future>

#include "tests/unit/server/transport_fixture.hpp"

namespace brainshift::server {
namespace {

TEST(Stopping, APreparationThatHeedsNoStopDelaysTheEndByItsGraceAlone) {
  std::promise<void> at_work, let_go;
  ServiceOptions options;
  options.model = small_model();
  options.make_model = [&](const SessionRequest& request, const auto&) {
    at_work.set_value();
    let_go.get_future().wait();
    return fake_session(std::make_unique<FakeInverter>(), request);
  };
  Outbox outbox;
  Service service(std::move(options), outbox);
  const std::string frame =
      wire::encode_frame(MessageType::kStartSessionRequest, 1, wire::encode(session_of()));
  service.handle("peer", value_or_fail(wire::decode_frame(frame)));
  at_work.get_future().wait();
  EXPECT_FALSE(service.stop(std::chrono::milliseconds(1)));
  let_go.set_value();
  EXPECT_TRUE(service.stop());
}

}  // namespace
}  // namespace brainshift::server
