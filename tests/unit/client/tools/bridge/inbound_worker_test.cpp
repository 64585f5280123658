// SPDX-License-Identifier: GPL-3.0-or-later
// Submitting to a daemon: tests/integration/test_bridge.py.
#include "client/tools/bridge/inbound_worker.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <thread>

namespace brainshift::client {
namespace {

using testing::HasSubstr;

Found boundary_at(const Vec3& centre) {
  Found found;
  found.source = "TumourNow";
  found.acquired = std::chrono::steady_clock::now() - std::chrono::milliseconds(40);
  found.told = "TumourNow: 3 boundary points";
  TumourBoundary boundary{Points(3, 3), 0.5};
  boundary.points << centre, centre + Vec3(1, 0, 0), centre - Vec3(1, 0, 0);
  found.body = boundary;
  return found;
}

const Followed kFollowed{"toy", Vec3(30, 30, 40), {7, 1, "model"}};

TEST(InboundWorker, AnObservationNamesCaseSessionSourceAndTimes) {
  const auto observation = observation_of(boundary_at(Vec3(31, 30, 40)), kFollowed, 12).value();
  EXPECT_EQ(observation.case_id, "toy");
  EXPECT_EQ(observation.session, kFollowed.session);
  EXPECT_EQ(observation.source, "TumourNow");
  EXPECT_EQ(observation.sequence, 12u);
  EXPECT_EQ(observation.frame, "ras");
  EXPECT_GE(observation.sent_ns - observation.acquired_ns, 40'000'000);
  EXPECT_GT(observation.acquired_wall_ns, 1'600'000'000'000'000'000) << "the wall clock";
}

TEST(InboundWorker, ABoundaryFarFromTheTumourIsRefused) {
  const auto far = observation_of(boundary_at(Vec3(-130, 30, 40)), kFollowed, 1);
  ASSERT_FALSE(far);
  EXPECT_EQ(far.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(far.error().message, HasSubstr("160 mm from the tumour of case toy"));
  EXPECT_TRUE(observation_of(boundary_at(Vec3(-69, 30, 40)), kFollowed, 1));
}

TEST(InboundWorker, WithoutASessionItSaysSo) {
  std::promise<std::string> told;
  InboundWorker worker(Inbox::open({.tumour_device = "F"}).value(), "tcp://127.0.0.1:1", {},
                       [&](const std::string& line) { told.set_value(line); });
  igtl::Message message;
  message.envelope.device = "F";
  igtl::PointList list;
  list.points.resize(1);
  message.content = list;
  worker.post(std::move(message));
  const std::jthread thread([&](const std::stop_token& stop) { worker.run(stop); });
  EXPECT_THAT(told.get_future().get(), HasSubstr("not accepted: no session runs"));
}

}  // namespace
}  // namespace brainshift::client
