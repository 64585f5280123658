// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/model_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "common/inversion/prepared/condense.hpp"
#include "tests/support/toy_patient.hpp"
#include "tests/unit/server/sample_values.hpp"

namespace brainshift::server {
namespace {

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

Observation tumour_moved(std::uint64_t sequence) {
  LandmarkPairs pairs;
  pairs.undeformed = patient()->tumour.vertices;
  pairs.deformed = pairs.undeformed.colwise() + Vec3(3, 0, 3);
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
  const auto made = store.make({});
  ASSERT_TRUE(made.has_value());
  const auto update = (*made)->pipeline.run(tumour_moved(1));
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
  const auto made = store.make({});
  ASSERT_FALSE(made.has_value());
  EXPECT_EQ(made.error().message, "toy.h5: is altered");
}

TEST(ModelStore, OperatorsThatTheFileLacksAreMade) {
  ModelStore store(patient(), config(), {},
                   [](Boundary) -> Result<std::optional<CondensedOperators>> {
                     return std::optional<CondensedOperators>();
                   });
  const auto made = store.make({});
  ASSERT_TRUE(made.has_value()) << made.error().message;
  EXPECT_GT((*made)->info.prepare_s, 0.0);
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
  EXPECT_THAT(message->update.estimate.reason, testing::HasSubstr("loads and contact settled"));
}

}  // namespace
}  // namespace brainshift::server
