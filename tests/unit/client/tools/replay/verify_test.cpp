// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "client/tools/replay/verify.hpp"
#include "common/wire/convert.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/client/tools/replay/scripted_daemon.hpp"

namespace brainshift::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// A daemon whose field is a function of the observation, and the journal of a session with it.
class Verify : public testing::Test {
 protected:
  void SetUp() override {
    auto created = value_or_fail(io::SurgeryFile::create(folder / "a.surgery", {.case_id = "box"}));
    file.emplace(std::move(created));
    daemon.script = [this](const Observation& o) {
      sent.push_back(o.source + std::to_string(o.sequence));
      if (fails == o.sequence) return std::vector{failure(o.sequence)};
      UpdateMessage iterate = update(o.sequence, false);
      UpdateMessage last = answer(o.sequence);
      if (differs == o.sequence) last.update.estimate.displacement(0, 0) += 0.5;
      return std::vector{std::move(iterate), std::move(last)};
    };
  }
  static UpdateMessage failure(std::uint64_t observation) {
    UpdateMessage message = update(observation, true);
    message.error = Error{ErrorCode::kNotConverged, "no luck"};
    return message;
  }
  static UpdateMessage answer(std::uint64_t observation) {
    UpdateMessage message = update(observation, true);
    message.update.timings = {};
    message.update.estimate.history.clear();
    message.update.estimate.displacement.setConstant(static_cast<double>(observation));
    return message;
  }
  void record_observation(const std::string& source, std::uint64_t sequence) {
    Observation observation;
    observation.case_id = "box";
    observation.source = source;
    observation.sequence = sequence;
    observation.body = LandmarkPairs{Points::Ones(3, 4), Points::Ones(3, 4), 0.3};
    append(io::RecordKind::kObservation, sequence, wire::encode(observation));
  }
  void record_decision(const std::string& source, std::uint64_t sequence, Outcome outcome,
                       std::uint64_t update) {
    append(io::RecordKind::kDecision, sequence,
           wire::encode(Decision{1, source, sequence, outcome, update, 0, "why"}));
  }
  void record_update(std::uint64_t sequence, std::uint64_t observation) {
    UpdateMessage message = answer(observation);
    message.session_id = 99;
    message.update.sequence = sequence;
    append(io::RecordKind::kUpdate, sequence, wire::encode(message));
  }
  void append(io::RecordKind kind, std::uint64_t sequence, std::string payload) {
    ASSERT_TRUE(file->append({kind, sequence, 0, std::move(payload)}));
  }
  // Accepted: ius 1, 2, 3 and camera 2. ius 2 is superseded, camera 2 fails.
  void record_session() {
    record_observation("ius", 1);
    record_observation("ius", 2);
    record_observation("camera", 7);
    record_decision("ius", 1, Outcome::kUsed, 1);
    record_observation("ius", 3);
    record_decision("ius", 2, Outcome::kSuperseded, 0);
    record_update(1, 1);
    record_decision("ius", 3, Outcome::kUsed, 2);
    record_update(2, 3);
    record_decision("camera", 7, Outcome::kFailed, 3);
  }
  Result<Verification> verify() {
    return verify_records(*file, daemon.link(), {kSession, Agreement::kBitForBit, timeout});
  }

  const test_support::TemporaryFolder folder;
  std::optional<io::SurgeryFile> file;
  ScriptedDaemon daemon;
  std::vector<std::string> sent;
  std::uint64_t differs = 0, fails = 7;
  std::chrono::milliseconds timeout{5000};
};

TEST_F(Verify, SendsWhatWasTriedInItsOrderAndFindsTheSameAnswers) {
  record_session();
  const auto verification = value_or_fail(verify());
  EXPECT_THAT(sent, ElementsAre("ius1", "ius3", "camera7"));
  EXPECT_EQ(verification.compared, 3u);
  EXPECT_THAT(verification.differences, IsEmpty());
  EXPECT_THAT(report_lines(verification),
              ElementsAre(HasSubstr("3 of 3 answers agree bit for bit")));
}

TEST_F(Verify, NamesTheUpdatesThatDiffer) {
  record_session();
  differs = 3;
  fails = 0;
  const auto verification = value_or_fail(verify());
  EXPECT_THAT(verification.differences,
              ElementsAre(HasSubstr("update 2 (observation 3): displacement: 1 numbers"),
                          HasSubstr("update 3 (observation 7): failed when recorded")));
  EXPECT_DOUBLE_EQ(verification.max_difference_mm, 0.5);
  EXPECT_THAT(report_lines(verification).front(), HasSubstr("1 of 3 answers agree"));
}

TEST_F(Verify, AnAnswerThatFailsNowDiffers) {
  record_session();
  fails = 1;
  const auto verification = value_or_fail(verify());
  EXPECT_THAT(verification.differences.front(), HasSubstr("error: \"none\" recorded"));
}

TEST_F(Verify, AJournalThatLacksSomethingIsRefused) {
  record_decision("ius", 1, Outcome::kUsed, 1);
  EXPECT_THAT(verify().error().message, HasSubstr("observation 1 of ius is not recorded"));
}

TEST_F(Verify, AnUpdateWithoutADecisionIsRefused) {
  record_observation("ius", 1);
  record_update(1, 1);
  EXPECT_THAT(verify().error().message, HasSubstr("update 1: no decision leads to it"));
}

TEST_F(Verify, AJournalWithoutAnswersIsRefused) {
  record_observation("ius", 1);
  EXPECT_EQ(verify().error().code, ErrorCode::kEmptySet);
}

TEST_F(Verify, ASilentDaemonIsReported) {
  record_session();
  daemon.script = [](const Observation&) { return std::vector<UpdateMessage>(); };
  timeout = std::chrono::milliseconds(20);
  EXPECT_EQ(verify().error().code, ErrorCode::kUnavailable);
}

UpdateMessage answer() {
  UpdateMessage message;
  message.session_id = 1;
  message.update.sequence = 3;
  Estimate& estimate = message.update.estimate;
  estimate.status = EstimateStatus::kConverged;
  estimate.quality.quality = Quality::kGood;
  estimate.displacement = Points::Constant(3, 5, 4.0);
  estimate.sd_mm = VecX::Constant(5, 0.5);
  estimate.known = VecX::Constant(5, 0.8);
  estimate.active_slaves = {3, 7};
  estimate.contact.active = 2;
  estimate.contact_force_n = VecX::Constant(2, 0.25);
  estimate.misfit_mm = {0.1, 0.05};
  estimate.sources = {{"ius", 9, 0.0, 40, 1}};
  message.update.left_out = {{"pressure", "drained", "0"}};
  return message;
}

std::vector<std::string> differences(const UpdateMessage& other,
                                     Agreement agreement = Agreement::kBitForBit) {
  return compare_updates(answer(), other, agreement).differences;
}

TEST(CompareUpdates, NumbersTimesAndTheJournalsOmissionAreOfTheSession) {
  UpdateMessage other = answer();
  other.session_id = 8;
  other.update.sequence = 9;
  other.update.timings.invert_ms = 7.0;
  other.update.estimate.rebuild_ms = 7.0;
  other.update.left_out.push_back({"journal", "disk full", "none"});
  EXPECT_THAT(differences(other), IsEmpty());
}

TEST(CompareUpdates, EveryPartThatDiffersIsNamed) {
  const auto told = [](auto change) {
    UpdateMessage other = answer();
    change(other, other.update.estimate);
    const auto found = differences(other);
    return found.size() == 1 ? found[0] : std::to_string(found.size()) + " differences";
  };
  EXPECT_THAT(told([](auto& m, auto&) {
                m.error = Error{ErrorCode::kNotConverged, "x"};
              }),
              HasSubstr("error: \"none\" recorded, \"not_converged\" now"));
  EXPECT_THAT(told([](auto&, auto& e) { e.status = EstimateStatus::kDeadline; }),
              HasSubstr("status"));
  EXPECT_THAT(told([](auto&, auto& e) { e.quality.quality = Quality::kCaution; }),
              HasSubstr("quality"));
  EXPECT_THAT(told([](auto&, auto& e) { e.quality.flags.set(QualityFlag::kDeadline); }),
              HasSubstr("flags"));
  EXPECT_THAT(told([](auto&, auto& e) { e.displacement(2, 4) = 4.5; }),
              HasSubstr("displacement: 1 numbers by up to 0.5"));
  EXPECT_THAT(told([](auto&, auto& e) { e.displacement.resize(3, 4); }), HasSubstr("12 now"));
  EXPECT_THAT(told([](auto&, auto& e) { e.sd_mm[0] = 0.25; }), HasSubstr("sd_mm"));
  EXPECT_THAT(told([](auto&, auto& e) { e.known[4] = 0.0; }), HasSubstr("known: 1 numbers"));
  EXPECT_THAT(told([](auto&, auto& e) { e.region_known = 0.5; }), HasSubstr("of the region"));
  EXPECT_THAT(told([](auto&, auto& e) { e.active_slaves[1] = 8; }), HasSubstr("active slaves"));
  EXPECT_THAT(told([](auto&, auto& e) { e.contact_force_n[1] = 1; }), HasSubstr("forces"));
  EXPECT_THAT(told([](auto&, auto& e) { e.misfit_mm.mean = 1; }), HasSubstr("misfit"));
  EXPECT_THAT(told([](auto&, auto& e) { e.sources[0].outliers = 2; }), HasSubstr("sources"));
  EXPECT_THAT(told([](auto&, auto& e) { e.sources.clear(); }), HasSubstr("sources"));
  EXPECT_THAT(told([](auto& m, auto&) { m.update.left_out.clear(); }), HasSubstr("left out"));
  EXPECT_THAT(told([](auto& m, auto&) { m.update.T_undeformed_deformed.translation().x() = 1; }),
              HasSubstr("alignment"));
}

TEST(CompareUpdates, RoundingIsADifferenceOfBitsOnly) {
  UpdateMessage other = answer();
  // The neighbour of 4 among 32-bit floats: 4.8e-7 mm away.
  other.update.estimate.displacement(0, 0) = std::nextafterf(4.0f, 5.0f);
  EXPECT_THAT(differences(other), ElementsAre(HasSubstr("displacement")));
  EXPECT_THAT(differences(other, Agreement::kWithinRounding), IsEmpty());
  other.update.estimate.displacement(0, 0) = 4.0 + 2e-6;
  EXPECT_THAT(differences(other, Agreement::kWithinRounding),
              ElementsAre(HasSubstr("displacement: 1 numbers by up to 2e-06")));
  EXPECT_DOUBLE_EQ(compare_updates(answer(), other, Agreement::kWithinRounding).displacement_mm,
                   (4.0 + 2e-6) - 4.0);
  other = answer();
  other.update.estimate.known.resize(0);  // a journal from before
  other.update.estimate.misfit_mm.mean += 1e-12;
  EXPECT_THAT(differences(other, Agreement::kWithinRounding), IsEmpty());
}

TEST(CompareUpdates, TwoFailuresOfOneKindAgree) {
  UpdateMessage a = answer(), b = answer();
  a.error = Error{ErrorCode::kNotConverged, "after 3 ms"};
  b.error = Error{ErrorCode::kNotConverged, "after 4 ms"};
  EXPECT_THAT(compare_updates(a, b, Agreement::kBitForBit).differences, IsEmpty());
  b.error->code = ErrorCode::kInternal;
  EXPECT_THAT(compare_updates(a, b, Agreement::kBitForBit).differences.size(), 1u);
}

}  // namespace
}  // namespace brainshift::client
