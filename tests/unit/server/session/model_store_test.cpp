// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/model_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
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
    EXPECT_EQ(info.factor_s > 0.0, method != Method::kCondensed) << to_string(method);
    EXPECT_EQ(info.full_solve_ms, 0.0) << "nobody asked for it";
  }
}

TEST(ModelStore, MeasuresAFullSolveOnRequest) {
  ModelStore store(patient(), config(), {operators()});
  SessionRequest request;
  request.measure_full_solve = true;
  const auto made = store.make(request);
  ASSERT_TRUE(made.has_value());
  EXPECT_GT((*made)->info.full_solve_ms, 0.0);
  EXPECT_GT((*made)->info.factor_s, 0.0);
  const auto again = store.make(request);
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ((*again)->info.full_solve_ms, (*made)->info.full_solve_ms) << "measured once";
}

TEST(ModelStore, KeepsTheFactorThatAMethodNeedsWhereItWasMeasuredToo) {
  ModelStore store(patient(), config(), {operators()});
  SessionRequest request;
  request.measure_full_solve = true;
  ASSERT_TRUE(store.make(request).has_value());
  request.method = Method::kPaper;
  const auto made = store.make(request);
  ASSERT_TRUE(made.has_value()) << made.error().message;
  EXPECT_GT((*made)->info.factor_s, 0.0);
  EXPECT_TRUE((*made)->pipeline.run(tumour_moved(1)).has_value());
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
    EXPECT_EQ((*made)->info.factor_s, 0.0) << "nothing had to be factorised";
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

// Waits for the stop that only a new session requests, then lets the real inverter run with it.
class StoppedOnTheWay final : public inversion::Inverter {
 public:
  explicit StoppedOnTheWay(std::unique_ptr<inversion::Inverter> real) : real_(std::move(real)) {}
  void reset() override { real_->reset(); }
  std::optional<inversion::OmissionErrors> omission_errors() const override {
    return real_->omission_errors();
  }
  std::uint64_t bytes() const override { return real_->bytes(); }

  int calls = 0;
  std::promise<void> entered;
  std::vector<std::string> outcomes;  // of each update, in words

 private:
  Status invert(const SparseData& data, const inversion::InversionOptions& options,
                Estimate& estimate) override {
    if (++calls == 1) {
      std::promise<void> stopped;
      const std::stop_callback wake(options.stop, [&] { stopped.set_value(); });
      entered.set_value();
      stopped.get_future().wait();
    }
    auto status = real_->update(data, options, estimate);
    outcomes.push_back(status ? estimate.reason : status.error().message);
    return status;
  }

  std::unique_ptr<inversion::Inverter> real_;
};

// The default method, from Session::start() down to its loop over contact sets.
TEST(Cancellation, ANewSessionEndsARunningCondensedInversionEarly) {
  const auto locator = std::make_shared<const geometry::TetLocator>(patient()->mesh);
  auto real = inversion::condensed_inverter(std::make_shared<const CondensedOperators>(operators()),
                                            locator, config());
  ASSERT_TRUE(real.has_value());
  auto inverter = std::make_unique<StoppedOnTheWay>(std::move(*real));
  StoppedOnTheWay& watched = *inverter;
  SessionHooks hooks;
  hooks.make_model = [&](const SessionRequest& request, const std::stop_token&) {
    auto pipeline = pipeline::Pipeline::build(patient(), config(), request.method, request.boundary,
                                              std::move(inverter));
    EXPECT_TRUE(pipeline.has_value());
    SessionInfo info;
    return std::make_unique<SessionModel>(SessionModel{std::move(info), std::move(*pipeline)});
  };
  std::promise<UpdateMessage> published;
  hooks.publish = [&](UpdateMessage message, const Handled&) {
    published.set_value(std::move(message));
  };
  Session session("toy", std::move(hooks), kBootId, kModelId);
  SessionRequest request;
  request.case_id = "toy";
  const auto start = [&] {
    std::promise<bool> ready;
    session.start(request, [&](const auto& info) { ready.set_value(info.has_value()); });
    return ready.get_future().get();
  };
  ASSERT_TRUE(start());
  ASSERT_TRUE(session.submit(tumour_moved(1)).has_value());
  watched.entered.get_future().wait();
  ASSERT_TRUE(start());
  ASSERT_TRUE(session.submit(in_session(2, tumour_moved(2))).has_value());
  const UpdateMessage message = published.get_future().get();
  session.stop();
  EXPECT_EQ(message.update.observation_sequence, 2u);  // the first one is not published
  EXPECT_FALSE(message.error.has_value());
  ASSERT_EQ(watched.outcomes.size(), 2u);
  EXPECT_EQ(watched.outcomes[0], "inversion was stopped at iteration 1");
  EXPECT_THAT(watched.outcomes[1], testing::HasSubstr("loads and contact settled"));
}

}  // namespace
}  // namespace brainshift::server
