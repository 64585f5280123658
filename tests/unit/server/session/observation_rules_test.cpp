// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/observation_rules.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "tests/unit/server/sample_values.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;

struct BadObservation {
  const char* name;
  void (*spoil)(Observation&);
  ErrorCode code;
  const char* says;
};

void PrintTo(const BadObservation& bad, std::ostream* stream) { *stream << bad.name; }

class ObservationRules : public testing::TestWithParam<BadObservation> {};

TEST_P(ObservationRules, AreNamedWhenBroken) {
  Observation observation = landmarks(2);
  const auto check = [&] { return check_observation(observation, kCase, {kBootId, 1, kModelId}); };
  ASSERT_TRUE(check().has_value());
  GetParam().spoil(observation);
  const auto status = check();
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().code, GetParam().code);
  EXPECT_THAT(status.error().message, HasSubstr(GetParam().says));
  EXPECT_THAT(status.error().message, testing::Not(HasSubstr("\n")));
}

INSTANTIATE_TEST_SUITE_P(
    Table, ObservationRules,
    testing::Values(BadObservation{"OtherCase", [](Observation& o) { o.case_id = "x\ny"; },
                                   ErrorCode::kInvalidArgument, "case_id = \"x?y\""},
                    BadObservation{"OtherFrame", [](Observation& o) { o.frame = "lps"; },
                                   ErrorCode::kInvalidArgument, "frame = \"lps\""},
                    BadObservation{"NoSource", [](Observation& o) { o.source.clear(); },
                                   ErrorCode::kInvalidArgument, "source"},
                    BadObservation{"EndlessSource",
                                   [](Observation& o) { o.source.assign(1000, 'a'); },
                                   ErrorCode::kInvalidArgument, "1 to 64 characters"},
                    BadObservation{"NoSession", [](Observation& o) { o.session = {}; },
                                   ErrorCode::kInvalidArgument, "session is absent"},
                    BadObservation{"EarlierSession",
                                   [](Observation& o) { o.session.session_id = 0; },
                                   ErrorCode::kInvalidArgument, "the running session is 1"},
                    BadObservation{"OtherModel", [](Observation& o) { o.session.model_id = "x"; },
                                   ErrorCode::kInvalidArgument, "model_id = \"x\""},
                    BadObservation{"OtherDaemon", [](Observation& o) { o.session.boot_id = 1; },
                                   ErrorCode::kInvalidArgument, "restarted"},
                    BadObservation{"Pose", [](Observation& o) { o.body = PatientPose{}; },
                                   ErrorCode::kInvalidArgument, "patient_pose"}),
    [](const auto& row) { return row.param.name; });

TEST(InQuotes, IsOneShortLineWhateverItHolds) {
  EXPECT_EQ(in_quotes("plain"), "\"plain\"");
  EXPECT_EQ(in_quotes("a\nb\x1b"), "\"a?b?\"");
  EXPECT_EQ(in_quotes(std::string(200, 'x')), "\"" + std::string(64, 'x') + "...\"");
}

}  // namespace
}  // namespace brainshift::server
