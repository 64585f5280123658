// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cctype>
#include <random>

#include "brainshift/v1/brainshift.pb.h"
#include "tests/support/results.hpp"
#include "tests/unit/wire/same_values.hpp"
#include "tests/unit/wire/sample_values.hpp"

namespace brainshift::wire {
namespace {

namespace pb = brainshift::v1;

template <typename T>
void expect_round_trip(const T& value, Result<T> (*decode)(std::string_view)) {
  const auto decoded = value_or_fail(decode(encode(value)));
  expect_same(value, decoded);
}

TEST(RoundTrip, EveryObservationKindIsReproduced) {
  for (int kind = 0; kind < 4; ++kind) {
    SCOPED_TRACE(kind);
    expect_round_trip(sample_observation(kind), decode_observation);
  }
}

TEST(RoundTrip, NegativeZeroKeepsItsSign) {
  const auto decoded = value_or_fail(decode_observation(encode(sample_observation(3))));
  const auto& pose = std::get<PatientPose>(decoded.body);
  EXPECT_TRUE(std::signbit(pose.gravity_direction.y()));
  ASSERT_TRUE(pose.fluid_level_mm.has_value());
  EXPECT_TRUE(std::signbit(*pose.fluid_level_mm));
}

TEST(RoundTrip, AbsentFluidLevelStaysAbsentAndZeroStaysPresent) {
  Observation observation = sample_observation(3);
  std::get<PatientPose>(observation.body).fluid_level_mm.reset();
  expect_round_trip(observation, decode_observation);
  std::get<PatientPose>(observation.body).fluid_level_mm = 0.0;
  expect_round_trip(observation, decode_observation);
}

TEST(RoundTrip, ObservationsWithoutPointsAreReproduced) {
  for (int kind = 0; kind < 3; ++kind) {
    Observation observation = sample_observation(kind);
    if (kind == 0) observation.body = TumourBoundary{Points(3, 0), 0.5};
    if (kind == 1) observation.body = CorticalSurface{{awkward_points(2), {}}, 0.5};
    if (kind == 2) observation.body = LandmarkPairs{Points(3, 0), Points(3, 0), 0.5};
    expect_round_trip(observation, decode_observation);
  }
}

TEST(RoundTrip, ModelIsReproduced) { expect_round_trip(sample_model(), decode_model); }

TEST(RoundTrip, ModelWithoutLabelsIsReproduced) {
  BrainModel model = sample_model();
  model.mesh.labels.clear();
  model.tumour = {};
  expect_round_trip(model, decode_model);
}

TEST(RoundTrip, UpdateIsReproduced) { expect_round_trip(sample_update(), decode_update); }

TEST(RoundTrip, VerdictStrengthsAndCertificateAreReproduced) {
  expect_round_trip(sample_judged_update(), decode_update);
}

TEST(RoundTrip, WhatIsKnownIsReproducedToHalfAByteAndNothingElseIsKnown) {
  UpdateMessage message = sample_update();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  message.update.estimate.known = Eigen::Vector4d(0.123, 1.0 + 1e-12, -1e-12, nan);
  const auto known = value_or_fail(decode_update(encode(message))).update.estimate.known;
  ASSERT_EQ(known.size(), 4);
  EXPECT_NEAR(known[0], 0.123, 0.5 / 255.0);
  EXPECT_EQ(known[1], 1.0);
  EXPECT_EQ(known[2], 0.0);
  EXPECT_EQ(known[3], 0.0);
}

TEST(RoundTrip, EveryVerdictIsReproduced) {
  UpdateMessage message = sample_update();
  message.update.estimate.quality.quality = Quality::kGood;
  expect_round_trip(message, decode_update);
  for (const QualityFlag flag : kAllQualityFlags) {
    if (flag == QualityFlag::kNotFinite) continue;
    SCOPED_TRACE(to_string(flag));
    QualityVerdict verdict;
    verdict.flags.set(flag);
    verdict.quality = verdict.flags.quality();
    message.update.estimate.quality = verdict;
    expect_round_trip(message, decode_update);
  }
}

TEST(RoundTrip, StrengthsThatAreTheCasesAreNotSent) {
  UpdateMessage message = sample_update();
  const std::string plain = encode(message);
  message.update.estimate.prior_at_bound.back() = true;
  EXPECT_GT(encode(message).size(), plain.size());
  expect_round_trip(message, decode_update);
}

// Else the receiver would reject the numbers, and the verdict with them.
TEST(RoundTrip, AnEstimateThatIsNotFiniteTravelsWithoutItsNumbers) {
  UpdateMessage message = sample_judged_update();
  Estimate& estimate = message.update.estimate;
  estimate.sd_mm[1] = std::numeric_limits<double>::quiet_NaN();
  estimate.misfit_mm.mean = std::numeric_limits<double>::infinity();
  estimate.quality.flags.set(QualityFlag::kNotFinite);
  const auto decoded = value_or_fail(decode_update(encode(message)));
  const Estimate& received = decoded.update.estimate;
  EXPECT_EQ(received.status, EstimateStatus::kDeadline);
  EXPECT_EQ(received.quality.quality, Quality::kUnusable);
  EXPECT_EQ(received.quality.flags, estimate.quality.flags);
  EXPECT_EQ(received.quality.reason, estimate.quality.reason);
  EXPECT_EQ(received.displacement.cols(), 0);
  EXPECT_EQ(received.sd_mm.size(), 0);
  EXPECT_EQ(received.known.size(), 0);
  EXPECT_EQ(decoded.update.left_out.size(), message.update.left_out.size());
}

// The names of the messages are those of the library; the numbers are bits, counted from 1.
TEST(RoundTrip, NumbersOfTheVerdictAreThoseOfItsNames) {
  for (const QualityFlag flag : kAllQualityFlags) {
    UpdateMessage message = sample_update();
    message.update.estimate.quality.flags.set(flag);
    message.update.estimate.quality.quality = message.update.estimate.quality.flags.quality();
    pb::Update sent;
    ASSERT_TRUE(sent.ParseFromString(encode(message)));
    ASSERT_EQ(sent.quality_flags_size(), 1);
    std::string name = "QUALITY_FLAG_" + std::string(to_string(flag));
    for (char& c : name) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    EXPECT_EQ(pb::QualityFlag_Name(sent.quality_flags(0)), name);
    EXPECT_EQ(pb::Quality_Name(sent.quality()),
              message.update.estimate.quality.quality == Quality::kUnusable ? "QUALITY_UNUSABLE"
                                                                            : "QUALITY_CAUTION");
  }
}

TEST(RoundTrip, FailedUpdateCarriesItsErrorAndNoEstimate) {
  expect_round_trip(sample_failure(), decode_update);
}

TEST(RoundTrip, EveryEstimateStatusIsReproduced) {
  for (const auto status :
       {EstimateStatus::kNotRun, EstimateStatus::kIterating, EstimateStatus::kConverged,
        EstimateStatus::kIterationLimit, EstimateStatus::kDeadline}) {
    UpdateMessage message = sample_update();
    message.update.estimate.status = status;
    expect_round_trip(message, decode_update);
  }
}

TEST(RoundTrip, SessionMessagesAreReproduced) {
  expect_round_trip(
      DaemonStatus{"0.1.0", true, "Fall Köln", "0123456789abcdef", true, 1ull << 63, 1},
      decode_status);
  expect_round_trip(DaemonStatus{}, decode_status);
  for (const Method method : kAllMethods) {
    expect_round_trip(SessionRequest{"c", method, Boundary::kFixed, true, true, true},
                      decode_session_request);
  }
  expect_round_trip(SessionRequest{"", Method::kPaper, Boundary::kContact, false},
                    decode_session_request);
  expect_round_trip(
      SessionInfo{7, "id", 18475, std::numeric_limits<int>::max(), 906, 0.1, 1ull << 40, ~0ull},
      decode_session_info);
  expect_round_trip(ObservationReceipt{std::numeric_limits<std::uint64_t>::max(), true},
                    decode_observation_receipt);
  expect_round_trip(Subscription{~0ull, Subscription::kMaxWindow, 1ull << 40}, decode_subscription);
  SessionState state;
  state.session = {~0ull, 3, "id"};
  state.newest_update = 9;
  state.newest_usable = 8;
  state.age_ms = 1.0 / 3.0;
  state.valid_ms = 1000;
  state.reason = "no luck";
  state.preparing = true;
  state.aged_after_ms = 1;
  state.expired_after_ms = ~0u;
  state.recorded = true;
  state.method = "condensed";
  state.boundary = "contact";
  state.recording.emplace();
  state.recording->reason = "j.surgery: disk full";
  state.recording->sources = {{"ius", ~0ull, 1}, {"", 0, 0}};
  for (int phase = 0; phase <= static_cast<int>(SessionPhase::kClosed); ++phase) {
    state.phase = static_cast<SessionPhase>(phase);
    expect_round_trip(state, decode_session_state);
  }
}

// A viewer that does not say how much it can take gets one update at a time.
TEST(RoundTrip, AnAbsentWindowIsOne) {
  EXPECT_EQ(decode_subscription("").value(), (Subscription{0, 1, 0}));
}

TEST(RoundTrip, TheDaemonsTimeIsAddedWithoutDecoding) {
  Observation observation = sample_observation(2);
  observation.daemon_ns = 0;
  std::string payload = encode(observation);
  append_daemon_time(-5, payload);
  observation.daemon_ns = -5;
  const auto decoded = value_or_fail(decode_observation(payload));
  expect_same(observation, decoded);
}

TEST(RoundTrip, EveryErrorCodeIsReproduced) {
  for (int code = 0; code <= static_cast<int>(ErrorCode::kInternal); ++code) {
    const Error error{static_cast<ErrorCode>(code),
                      "case.yaml: mesh.edge_mm = -1: must be positive"};
    expect_same(error, decode_error(encode(error)));
  }
}

TEST(RoundTrip, AFieldOfAHeadMeshIsReproducedAsFloats) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0.0, 4.0);
  UpdateMessage message = sample_update();
  message.update.estimate.displacement =
      Points::NullaryExpr(3, 18475, [&] { return normal(random); });
  message.update.estimate.sd_mm = VecX::NullaryExpr(18475, [&] { return normal(random); });
  message.update.estimate.known = VecX::Constant(18475, 0.5);
  const std::string payload = encode(message);
  const auto decoded = value_or_fail(decode_update(payload));
  expect_same_matrix(decoded.update.estimate.displacement.cast<float>(),
                     message.update.estimate.displacement.cast<float>());
  // Four bytes per number, one for what is known, and next to nothing else.
  EXPECT_LT(payload.size(), (4u * 4u + 1u) * 18475u + 2000u);
  EXPECT_NEAR((decoded.update.estimate.known.array() - 0.5).abs().maxCoeff(), 0.5 / 255.0, 1e-9);
}

TEST(Text, BytesThatAreNotUtf8AreReplacedSoThatThePeerCanRead) {
  const Error error{ErrorCode::kNotFound,
                    "caf\xe9.yaml, \xc3\xa9t\xc3\xa9, \xed\xa0\x80, \xf0\x9f\xa7\xa0, \xe2\x82"};
  EXPECT_EQ(decode_error(encode(error)).message,
            "caf?.yaml, \xc3\xa9t\xc3\xa9, ???, \xf0\x9f\xa7\xa0, ??");
}

TEST(Text, AnErrorStaysOnOneLine) {
  EXPECT_EQ(decode_error(encode(Error{ErrorCode::kInternal, "a\nb\x1b[2Jc"})).message, "a b [2Jc");
}

}  // namespace
}  // namespace brainshift::wire
