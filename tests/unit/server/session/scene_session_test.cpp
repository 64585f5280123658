// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes through the whole line: case file's words -> session -> observation -> what the update
// says it left out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/fem/body_loads.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "common/pipeline/left_out.hpp"
#include "server/session/model_store.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/unit/server/sample_values.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;

class SceneSession : public ::testing::Test {
 protected:
  static CaseConfig config() {
    CaseConfig config = test_support::toy_config();
    config.condensed.max_rank = 40;
    config.condensed.uncertainty_nodes = 40;
    return config;
  }
  static std::shared_ptr<const BrainModel> patient() {
    static const auto model = std::make_shared<const BrainModel>(test_support::toy_patient());
    return model;
  }
  static CondensedOperators operators() {
    static const CondensedOperators made = [] {
      const auto prepared =
          inversion::PreparedModel::prepare(patient(), config(), Boundary::kContact);
      return std::move(*inversion::condense(*prepared));
    }();
    return made;
  }
  static Result<std::unique_ptr<SessionModel>> session(const CaseConfig& config,
                                                       Method method = Method::kCondensed) {
    ModelStore store(patient(), config, {operators()});
    SessionRequest request;
    request.case_id = "toy";
    request.method = method;
    return store.make(request);
  }
  static Update run(const CaseConfig& config, const Vec3& shift) {
    const auto made = session(config);
    EXPECT_TRUE(made.has_value());
    LandmarkPairs pairs;
    pairs.undeformed = patient()->tumour.vertices;
    pairs.deformed = pairs.undeformed.colwise() + shift;
    Observation observation = landmarks(1);
    observation.body = pairs;
    auto update = (*made)->pipeline.run(observation);
    EXPECT_TRUE(update.has_value()) << update.error().message;
    return std::move(*update);
  }
  static const Omission* find(const Update& update, const std::string& part) {
    for (const Omission& omission : update.left_out) {
      if (omission.part == part) return &omission;
    }
    return nullptr;
  }
};

TEST_F(SceneSession, LeavesContactOutOnlyWhenNothingTouches) {
  const Update off_the_skull = run(config(), {0, 0, -0.05});
  ASSERT_EQ(off_the_skull.estimate.contact.active, 0);
  const Omission* contact = find(off_the_skull, "contact");
  ASSERT_NE(contact, nullptr);
  EXPECT_THAT(contact->reason, HasSubstr("mm off the skull"));
  EXPECT_THAT(contact->estimated_error, HasSubstr("0.00 mm"));
  const Update touching = run(config(), {3, 0, 3});
  ASSERT_GT(touching.estimate.contact.active, 0);
  EXPECT_EQ(find(touching, "contact"), nullptr);

  CaseConfig on = config();
  on.scene.contact = Carry::kOn;
  EXPECT_EQ(find(run(on, {0, 0, -0.05}), "contact"), nullptr);
}

TEST_F(SceneSession, PartsForcedOffAreListedWithReasonAndNumber) {
  CaseConfig off = config();
  off.scene.contact = off.scene.uncertainty = off.scene.gravity_modes = off.scene.far_field =
      Carry::kOff;
  off.scene.region_of_interest_mm = 5.0;
  const Update update = run(off, {3, 0, 3});
  EXPECT_EQ(update.estimate.contact.active, 0);
  EXPECT_EQ(update.estimate.sd_mm.size(), 0);
  for (const char* part : {"contact", "gravity modes", "far field"}) {
    ASSERT_NE(find(update, part), nullptr) << part;
    EXPECT_THAT(find(update, part)->reason, HasSubstr("= off")) << part;
    EXPECT_THAT(find(update, part)->estimated_error, HasSubstr("at most about ")) << part;
    EXPECT_THAT(find(update, part)->estimated_error, testing::Not(HasSubstr(" 0.00"))) << part;
  }
  ASSERT_NE(find(update, "uncertainty"), nullptr);
  EXPECT_THAT(find(update, "uncertainty")->reason, HasSubstr("scene.uncertainty = off"));
}

TEST_F(SceneSession, ByDefaultOnlyPressureIsLeftOutWhenTheBrainTouches) {
  const Update update = run(config(), {3, 0, 3});
  // And the parts of the prior that the toy's case switches off.
  std::vector<std::string> parts;
  for (const Omission& one : update.left_out) parts.push_back(one.part);
  const std::vector<Omission> off = pipeline::prior_omissions(config().prior);
  ASSERT_EQ(off.size(), 6u);
  EXPECT_THAT(parts, testing::Contains("pressure"));
  EXPECT_EQ(parts.size(), 1 + off.size());
  for (const Omission& one : off) EXPECT_THAT(parts, testing::Contains(one.part));
}

// What the drained limit moves a displacement by, against what the update says that it does.
TEST_F(SceneSession, PressureDiffersByNoMoreThanIsReported) {
  const auto limit = inversion::PreparedModel::prepare(patient(), config(), Boundary::kContact);
  const Points load =
      fem::buoyancy_load(patient()->mesh, config().material, {0, 0, -1}, 60.0, {0, 0, -1});
  const Points drained = limit->forward().solve(load);
  const double relaxation_s = pipeline::consolidation_time_s(patient()->mesh, config().material);
  double before = 1.0;
  for (const double relaxations : {0.3, 1.0, 10.0, 100.0}) {
    CaseConfig on = config();
    on.scene.pressure = Carry::kOn;
    on.scene.pressure_step_s = relaxations * relaxation_s;
    const auto model = inversion::PreparedModel::prepare(patient(), on, Boundary::kContact);
    ASSERT_TRUE(model.has_value()) << model.error().message;
    const double missing = (drained - model->forward().solve(load)).colwise().norm().maxCoeff() /
                           drained.colwise().norm().maxCoeff();
    EXPECT_LE(missing, pipeline::implicit_step_fraction(on.scene.pressure_step_s, relaxation_s));
    EXPECT_GT(missing,
              0.02 * pipeline::implicit_step_fraction(on.scene.pressure_step_s, relaxation_s));
    EXPECT_LT(missing, before);
    before = missing;
  }
}

TEST_F(SceneSession, PressureThatIsCarriedIsNotLeftOut) {
  CaseConfig on = config();
  on.scene.pressure = Carry::kOn;
  EXPECT_EQ(find(run(on, {3, 0, 3}), "pressure"), nullptr);
  CaseConfig slow = config();
  slow.scene.pressure_step_s = 2.0;
  slow.material.permeability_m3_s_kg = 1e-8;
  const Update update = run(slow, {3, 0, 3});
  const Omission* pressure = find(update, "pressure");
  ASSERT_NE(pressure, nullptr);
  EXPECT_THAT(pressure->reason, HasSubstr("relaxes in about 4.89 s"));
  EXPECT_THAT(pressure->estimated_error, HasSubstr("of the displacement by a load 2 s old"));
}

TEST_F(SceneSession, RefusesWhatIsNotAvailableBeforeASessionStarts) {
  CaseConfig pressure = config();
  pressure.scene.pressure = Carry::kOn;
  const auto refused = session(pressure, Method::kIterativeSolver);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("scene.pressure = on"));
  CaseConfig contact = config();
  contact.scene.contact = Carry::kOff;
  EXPECT_FALSE(session(contact, Method::kPaper).has_value());
}

}  // namespace
}  // namespace brainshift::server
