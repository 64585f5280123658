// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/compare_updates.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace brainshift::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

UpdateMessage answer() {
  UpdateMessage message;
  message.session_id = 1;
  message.update.sequence = 3;
  Estimate& estimate = message.update.estimate;
  estimate.status = EstimateStatus::kConverged;
  estimate.quality.quality = Quality::kGood;
  estimate.displacement = Points::Constant(3, 5, 4.0);
  estimate.sd_mm = VecX::Constant(5, 0.5);
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
