// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/model_store.hpp"

#include <gmock/gmock.h>

#include <utility>

#include "common/fem/body_loads.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "common/pipeline/scene.hpp"
#include "tests/support/results.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/unit/server/sample_values.hpp"

namespace brainshift::server {
namespace {

using testing::HasSubstr;

CaseConfig config() {
  CaseConfig config = test_support::toy_config();
  config.condensed.max_rank = 40;
  config.condensed.uncertainty_nodes = 40;
  return config;
}

std::shared_ptr<const BrainModel> patient() {
  static const auto model = std::make_shared<const BrainModel>(test_support::toy_patient());
  return model;
}

const CondensedOperators& operators() {
  static const CondensedOperators made = [] {
    const auto prepared =
        inversion::PreparedModel::prepare(patient(), config(), Boundary::kContact);
    return std::move(*inversion::condense(*prepared));
  }();
  return made;
}

Observation tumour_moved(std::uint64_t sequence, const Vec3& shift = {3, 0, 3}) {
  LandmarkPairs pairs;
  pairs.undeformed = patient()->tumour.vertices;
  pairs.deformed = pairs.undeformed.colwise() + shift;
  Observation observation = landmarks(sequence);
  observation.case_id = "toy";
  observation.body = pairs;
  return observation;
}

TEST(ModelStore, MakesASessionOfEveryMethodAndTellsItsSize) {
  ModelStore store(patient(), config(), {operators()});
  for (const Method method : kAllMethods) {
    SessionRequest request;
    request.method = method;
    const auto made = store.make(request);
    ASSERT_TRUE(made.has_value()) << to_string(method) << ": " << made.error().message;
    const SessionInfo& info = (*made)->info;
    EXPECT_EQ(info.model_id, patient()->model_id);
    EXPECT_EQ(info.nodes, patient()->mesh.num_nodes());
    EXPECT_EQ(info.slaves, static_cast<int>(patient()->slaves.size()));
    EXPECT_GT(info.model_bytes, 0u) << to_string(method);
    EXPECT_GT(info.prepare_s, 0.0) << to_string(method);
  }
}

TEST(ModelStore, CondensesWhenTheModelFileHoldsNoOperators) {
  ModelStore store(patient(), config(), {});
  const auto made = value_or_fail(store.make({}));
  const auto update = made->pipeline.run(tumour_moved(1));
  ASSERT_TRUE(update.has_value());
  EXPECT_EQ(update->estimate.status, EstimateStatus::kConverged);
}

// Until a session needs them, operators of the other boundary condition stay in the file.
TEST(ModelStore, ReadsOperatorsWhenASessionFirstNeedsThem) {
  int reads = 0;
  ModelStore store(patient(), config(), {},
                   [&](Boundary boundary) -> Result<std::optional<CondensedOperators>> {
                     ++reads;
                     EXPECT_EQ(boundary, Boundary::kContact);
                     return operators();
                   });
  EXPECT_EQ(reads, 0);
  for (int session = 0; session < 2; ++session) {
    const auto made = store.make({});
    ASSERT_TRUE(made.has_value()) << made.error().message;
    EXPECT_EQ(reads, 1);
  }
}

TEST(ModelStore, OperatorsThatCannotBeReadEndThePreparation) {
  ModelStore store(patient(), config(), {},
                   [](Boundary) -> Result<std::optional<CondensedOperators>> {
                     return fail(ErrorCode::kUnreadable, "toy.h5: is altered");
                   });
  EXPECT_EQ(sentence_of(store.make({})), "toy.h5: is altered");
}

TEST(ModelStore, OperatorsThatTheFileLacksAreMade) {
  ModelStore store(patient(), config(), {},
                   [](Boundary) -> Result<std::optional<CondensedOperators>> {
                     return std::optional<CondensedOperators>();
                   });
  const auto made = value_or_fail(store.make({}));
  EXPECT_GT(made->info.prepare_s, 0.0);
}

// The default method, from Session::start() down to its loop over contact sets.
TEST(Cancellation, ANewSessionEndsARunningCondensedInversionEarly) {
  ModelStore store(patient(), config(), {operators()});
  Session session("toy", kBootId, patient()->model_id);
  SessionRequest request;
  request.case_id = "toy";
  const auto start = [&] {
    session.start(request, {});
    if (session.next_preparation()) session.prepared(store.make(request));
  };
  const auto observe = [&](std::uint64_t session_id) {
    Observation observation = in_session(session_id, tumour_moved(session_id));
    observation.session.model_id = patient()->model_id;
    EXPECT_TRUE(session.submit(observation, {}).has_value());
    return session.next_job({}).value();
  };
  const auto run = [](const Job& job) {
    return job.model->pipeline.run(job.observation, {{}, job.stop});
  };
  start();
  const Job first = observe(1);
  start();
  const auto stopped = run(first);
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().message, "inversion was stopped at iteration 1");
  EXPECT_FALSE(session.finish(first, stopped).has_value()) << "it is not published";
  EXPECT_FALSE(session.next_job({}).has_value());
  const Job second = observe(2);
  const auto message = session.finish(second, run(second));
  ASSERT_TRUE(message.has_value());
  EXPECT_FALSE(message->error.has_value());
  EXPECT_THAT(message->update.estimate.reason, HasSubstr("loads and contact settled"));
}

// ---------- scenes ----------

// Through the whole line: case file's words -> session -> observation -> what the update says it
// left out.
class SceneSession : public ::testing::Test {
 protected:
  static Result<std::unique_ptr<SessionModel>> session(const CaseConfig& config,
                                                       Method method = Method::kCondensed) {
    SessionRequest request;
    request.method = method;
    return ModelStore(patient(), config, {operators()}).make(request);
  }
  static Update run(const CaseConfig& config, const Vec3& shift) {
    const auto made = session(config);
    EXPECT_TRUE(made.has_value());
    return value_or_fail((*made)->pipeline.run(tumour_moved(1, shift)));
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
  ASSERT_EQ(off.size(), 7u);
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
    const auto model =
        value_or_fail(inversion::PreparedModel::prepare(patient(), on, Boundary::kContact));
    const double missing = (drained - model.forward().solve(load)).colwise().norm().maxCoeff() /
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
  EXPECT_THAT(refusal_of(session(pressure, Method::kIterativeSolver), ErrorCode::kInvalidArgument),
              HasSubstr("scene.pressure = on"));
  CaseConfig contact = config();
  contact.scene.contact = Carry::kOff;
  EXPECT_FALSE(session(contact, Method::kPaper).has_value());
}

}  // namespace
}  // namespace brainshift::server
