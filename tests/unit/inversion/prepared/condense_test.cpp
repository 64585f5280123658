// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "common/inversion/prepared/condense.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/operators/encode_columns.hpp"
#include "tests/support/results.hpp"
#include "tests/support/thread_ranks.hpp"
#include "tests/unit/inversion/condensed_fixture.hpp"
#include "tests/unit/inversion/toy_inversion.hpp"

namespace brainshift::inversion {
namespace {

TEST(PreparedModel, HoldsWhatItWasMadeFromAndItsTimes) {
  std::set<std::string> stages;
  CaseConfig config = test_support::toy_config();
  const std::vector<double> levels = config.prior.gravity_levels_mm;
  config.prior = {};  // every part:
  config.prior.gravity_direction_sd_deg = 10.0;
  config.prior.resection_weight_sd = 1.0;
  config.prior.resection_stress_sd_pa = 300.0;
  config.prior.gravity_levels_mm = levels;
  const auto model = value_or_fail(
      PreparedModel::prepare(patient(), config, Boundary::kFixed,
                             [&](std::string_view stage, double) { stages.emplace(stage); }));
  EXPECT_EQ(model.boundary(), Boundary::kFixed);
  EXPECT_EQ(&model.model(), patient().get());
  // Fluid levels in three directions and between sides and ends, the tumour's volume, bumps of the
  // brain's and at its ventricles, resection, opening, tract.
  EXPECT_EQ(model.prior().num_modes(), 10 + (27 + 27 + 7) + (4 + 6) + 9 + 21 + 15);
  EXPECT_GT(model.timings().factor_nonzeros, 0u);
  EXPECT_GT(model.timings().bytes, 0u);
  EXPECT_GE(model.timings().total_s, model.timings().factor_s);
  EXPECT_EQ(stages.count("prior"), 1u);
  EXPECT_EQ(stages.count("ready"), 1u);
}

TEST(PreparedModel, ABodyThatFloatsIsNamed) {
  auto floating = std::make_shared<BrainModel>(*patient());
  floating->fixed.clear();
  refusal_of(PreparedModel::prepare(floating, test_support::toy_config(), Boundary::kContact),
             ErrorCode::kFloatingBody);
}

PriorScaleValues all(double value) {
  PriorScaleValues scales;
  scales.fill(value);
  return scales;
}

// The scales multiply standard deviations: twice the scale of all parts is four times the
// covariance.
TEST(ScaledPrior, MultipliesTheStandardDeviationOfEveryPart) {
  const PreparedModel model = prepare(Boundary::kContact);
  const Points load = Points::Ones(3, patient()->mesh.num_nodes());
  const Points once = model.prior().apply(load);
  const Points twice = scaled_prior(model, all(2.0)).apply(load);
  ASSERT_GT(once.norm(), 0.0);
  EXPECT_LT((twice - 4.0 * once).norm(), 1e-12 * twice.norm());
  const Points without = scaled_prior(model, all(0.0)).apply(load);
  EXPECT_EQ(without.norm(), 0.0);
}

using testing::HasSubstr;

// Relative rounding of single precision, with room for the sums behind it.
constexpr double kFloat = 1e-6;

Eigen::MatrixXd rows_of(const CondensedOperators& operators, const std::vector<NodeIndex>& nodes,
                        int first, int count) {
  ThreadTeam team(1);
  return decode_rows(operators.responses, nodes, column_range(first, count), team).cast<double>();
}

std::vector<NodeIndex> all_nodes(const CondensedOperators& operators) {
  return column_range(0, operators.num_nodes());
}

TEST_F(Condensed, ContactColumnsAreTheResponsesToUnitForces) {
  const auto ops = operators(Boundary::kContact);
  const auto& forward = prepared(Boundary::kContact).forward();
  ASSERT_EQ(ops->num_slaves(), forward.contact().num_slaves());
  for (const int j : {0, 7, ops->num_slaves() - 1}) {
    const auto& pair = forward.contact().pairs()[static_cast<std::size_t>(j)];
    Points load = Points::Zero(3, patient()->mesh.num_nodes());
    load.col(pair.slave) = pair.normal;
    const Points u = forward.solve(load);
    const Eigen::Map<const VecX> expected(u.data(), u.size());
    ASSERT_GT(expected.cwiseAbs().maxCoeff(), 0.0);
    const int column = ops->contact_column(j);
    const VecX found = rows_of(*ops, all_nodes(*ops), column, 1);
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), kFloat * expected.cwiseAbs().maxCoeff());
    EXPECT_NEAR(ops->compliance(j, j), pair.normal.dot(u.col(pair.slave)),
                1e-12 * ops->compliance(j, j));
  }
  EXPECT_TRUE(ops->compliance == ops->compliance.transpose());
}

// What the search reads at the data and what is summed up to fields are the same numbers.
TEST_F(Condensed, RegionHasTheRowsOfTheCompactColumns) {
  const auto ops = operators(Boundary::kContact);
  const int columns = ops->responses.num_columns();
  const Eigen::MatrixXd unpacked = rows_of(*ops, ops->region, 0, columns);
  ASSERT_EQ(unpacked.rows(), ops->region_responses.rows());
  ASSERT_GT(unpacked.rows(), 0);
  for (int j = 0; j < columns; ++j) {
    const double step = static_cast<double>(ops->responses.parts().steps[j]);
    EXPECT_LT((unpacked.col(j) - ops->region_responses.col(j).cast<double>()).cwiseAbs().maxCoeff(),
              kMaxErrorSteps * step + kFloat * unpacked.col(j).cwiseAbs().maxCoeff())
        << j;
  }
}

// U U^T = C between any two nodes of the data region, and on the slaves' normals.
TEST_F(Condensed, ModesReproduceThePriorCovarianceWhereDataComeFrom) {
  const auto ops = operators(Boundary::kContact);
  const auto& model = prepared(Boundary::kContact);
  const Eigen::MatrixXd modes = ops->region_responses.leftCols(ops->num_modes()).cast<double>();
  const auto last = static_cast<Eigen::Index>(ops->region.size()) - 1;
  for (const Eigen::Index i : {Eigen::Index{0}, last}) {
    const NodeIndex node = ops->region[static_cast<std::size_t>(i)];
    Points unit = Points::Zero(3, patient()->mesh.num_nodes());
    unit(1, node) = 1.0;
    const Points column = model.forward().solve(model.prior().apply(model.forward().solve(unit)));
    const VecX row = modes.row(3 * i + 1).transpose();
    const double scale = column.cwiseAbs().maxCoeff();
    for (Eigen::Index j = 0; j <= last; ++j) {
      const NodeIndex other = ops->region[static_cast<std::size_t>(j)];
      for (int axis = 0; axis < 3; ++axis) {
        const double carried = modes.row(3 * j + axis).dot(row);
        EXPECT_NEAR(carried, column(axis, other), 10 * kFloat * scale);
      }
    }
  }
}

// In other units, or with every part switched off.
TEST_F(Condensed, APriorWithFarTooMuchMotionOrNoneIsRefusedWithTheFigure) {
  const double usual_mm = largest_motion_sd_mm(*operators(Boundary::kContact));
  EXPECT_GT(usual_mm, 0.5);
  EXPECT_LT(usual_mm, kMaxMotion_mm);
  const auto refused = [](const CaseConfig& with) {
    const auto model = value_or_fail(PreparedModel::prepare(patient(), with, Boundary::kContact));
    return refusal_of(condense(model), ErrorCode::kInvalidArgument);
  };
  CaseConfig strong = config();
  strong.prior.force_density_sd_n_m3 *= 1e4;
  strong.prior.gravity_mode_sd *= 1e4;
  EXPECT_THAT(refused(strong), HasSubstr("at most 500 mm"));
  CaseConfig none = config();
  none.prior.force_density_sd_n_m3 = none.prior.gravity_mode_sd = 0.0;
  EXPECT_THAT(refused(none), HasSubstr("above 0"));
}

TEST(BlockRunner, DealsAnEvenNumberOfBlocksOfAboutTheSameSize) {
  EXPECT_EQ(BlockRunner::block_size(0), 1);
  EXPECT_EQ(BlockRunner::block_size(1), 1);
  for (const int columns : {2, 47, 95, 96, 97, 192, 193, 239, 384, 2394, 7151}) {
    const int size = BlockRunner::block_size(columns), blocks = (columns + size - 1) / size;
    EXPECT_LE(size, BlockRunner::kBlock) << columns;
    EXPECT_LE(blocks * size - columns, blocks)
        << columns << ": the last one lacks no more than that";
    EXPECT_EQ(blocks % 2, 0) << columns;
  }
}

TEST_F(Condensed, FewerThreadsGiveTheSameBits) {
  CondenseOptions one;
  one.threads = 1;
  const auto serial = value_or_fail(condense(prepared(Boundary::kContact), one));
  CondenseOptions three;
  three.threads = 3;
  const auto parallel = value_or_fail(condense(prepared(Boundary::kContact), three));
  EXPECT_TRUE(serial.responses.parts() == parallel.responses.parts());
  EXPECT_TRUE(serial.compliance == parallel.compliance);
  EXPECT_TRUE(serial.truncated_variance_mm2 == parallel.truncated_variance_mm2);
}

// What the preparation of `model` needs with one thread and everything at hand, bytes.
std::uint64_t ample_bytes(const PreparedModel& model) {
  CondenseSizes sizes;
  sizes.nodes = model.model().mesh.num_nodes();
  sizes.slaves = model.forward().contact().num_slaves();
  sizes.region = static_cast<int>(data_region(model.model()).size());
  sizes.modes = model.config().condensed.max_rank;
  sizes.model_bytes = model.timings().bytes;
  return condense_memory_bytes(sizes);
}

TEST_F(Condensed, WithLittleMemoryItTakesLongerAndGivesTheSame) {
  CondenseOptions one;
  one.threads = 1;
  const auto ample = value_or_fail(condense(prepared(Boundary::kContact), one));
  const auto with_limit = [&](double share) {
    CaseConfig little = config();
    little.condensed.memory_limit_gib =
        share * static_cast<double>(ample_bytes(prepared(Boundary::kContact))) / (1 << 30);
    const auto model = value_or_fail(PreparedModel::prepare(patient(), little, Boundary::kContact));
    std::size_t reports = 0;
    one.progress = [&](std::string_view, double) { ++reports; };
    return std::pair(value_or_fail(condense(model, one)), reports);
  };
  const auto [same, reports] = with_limit(0.999);
  EXPECT_TRUE(same.responses.parts() == ample.responses.parts()) << "one field after the other";
  EXPECT_TRUE(same.compliance == ample.compliance);
  const auto [close, more_reports] = with_limit(0.6);
  EXPECT_GT(more_reports, reports) << "smaller blocks";
  EXPECT_LT((close.compliance - ample.compliance).norm(), 1e-12 * ample.compliance.norm());
}

// A store in memory that also remembers compliances, as a checkpoint does.
struct RememberingStore {
  std::map<int, std::pair<Eigen::MatrixXf, Eigen::MatrixXd>> kept;
  int saved = 0;

  CondenseOptions options() {
    CondenseOptions options;
    options.store.load = [this](int index, Eigen::MatrixXf& rows, Eigen::MatrixXd& compliance) {
      const auto found = kept.find(index);
      if (found == kept.end()) return false;
      std::tie(rows, compliance) = found->second;
      return true;
    };
    options.store.save = [this](int index, const Eigen::MatrixXf& rows,
                                const Eigen::MatrixXd& compliance) -> Status {
      kept[index] = {rows, compliance};
      ++saved;
      return {};
    };
    options.store.read = [this](int index, Eigen::Index first, Eigen::MatrixXf& out) -> Status {
      out = kept.at(index).first.middleCols(first, out.cols());
      return {};
    };
    return options;
  }
};

TEST_F(Condensed, FinishedBlocksAreNotSolvedAgainAndNeedNoMemoryOfTheirOwn) {
  RememberingStore store;
  const auto first = value_or_fail(condense(prepared(Boundary::kContact), store.options()));
  ASSERT_GT(store.saved, 0);
  store.saved = 0;
  const auto second = value_or_fail(condense(prepared(Boundary::kContact), store.options()));
  EXPECT_EQ(store.saved, 0);
  const auto in_memory = operators(Boundary::kContact);
  for (const auto& made : {&first, &second}) {
    EXPECT_TRUE(made->responses.parts() == in_memory->responses.parts());
    EXPECT_TRUE(made->compliance == in_memory->compliance);
    EXPECT_TRUE(made->region_responses == in_memory->region_responses);
  }
}

TEST_F(Condensed, AModelThatIsGivenAwayGivesTheSame) {
  auto model = value_or_fail(PreparedModel::prepare(patient(), config(), Boundary::kContact));
  const auto made = value_or_fail(condense(std::move(model)));
  EXPECT_TRUE(made.responses.parts() == operators(Boundary::kContact)->responses.parts());
}

TEST_F(Condensed, AStoreThatFailsEndsItWithTheStoresWords) {
  RememberingStore store;
  CondenseOptions full = store.options();
  full.store.save = [](int, const Eigen::MatrixXf&, const Eigen::MatrixXd&) -> Status {
    return fail(ErrorCode::kWriteFailed, "m.h5.partial: no space");
  };
  CondenseOptions torn = store.options();
  torn.store.read = [](int, Eigen::Index, Eigen::MatrixXf&) -> Status {
    return fail(ErrorCode::kUnreadable, "m.h5.partial: cannot be read");
  };
  EXPECT_EQ(sentence_of(condense(prepared(Boundary::kContact), full)), "m.h5.partial: no space");
  EXPECT_EQ(sentence_of(condense(prepared(Boundary::kContact), torn)),
            "m.h5.partial: cannot be read");
}

TEST_F(Condensed, AStoreWithANumberThatIsNotFiniteIsRefused) {
  RememberingStore store;
  ASSERT_TRUE(condense(prepared(Boundary::kContact), store.options()));
  store.kept.begin()->second.first(0, 5) = std::numeric_limits<float>::quiet_NaN();
  refusal_of(condense(prepared(Boundary::kContact), store.options()), ErrorCode::kNotFinite);
}

// A store and a model that is given away are what a large mesh needs.
TEST(CondenseMemory, OfAHundredThousandNodesIsWithinTheDefaultWithColumnsOnDisk) {
  CondenseSizes sizes;
  sizes.nodes = 94000;
  sizes.slaves = 7200;
  sizes.region = 12000;
  sizes.modes = 116;
  sizes.threads = 2;
  sizes.model_bytes = 4250000000;
  const auto gib = [&] { return static_cast<double>(condense_memory_bytes(sizes)) / (1 << 30); };
  EXPECT_GT(gib(), 12.0);
  sizes.model_stays = sizes.columns_in_memory = false;
  EXPECT_LT(gib(), CaseConfig{}.condensed.memory_limit_gib);
}

TEST(CondenseMemory, OfAQuarterMillionNodesFitsIntoTwentyGibBySavingNoMoreThanItMust) {
  CondenseSizes sizes;
  sizes.nodes = 242402;
  sizes.slaves = 13400;
  sizes.region = 3000;
  sizes.modes = 189;
  sizes.threads = 2;
  sizes.model_bytes = 15355000000;
  sizes.model_stays = sizes.columns_in_memory = false;
  const std::uint64_t limit = std::uint64_t{20} << 30;
  EXPECT_GT(condense_memory_bytes(sizes), limit);
  const CondenseSizes saving = within_memory(sizes, limit);
  EXPECT_LE(condense_memory_bytes(saving), limit);
  EXPECT_EQ(saving.block, BlockRunner::kBlock / 2);
  EXPECT_TRUE(saving.one_field_at_a_time);
  EXPECT_EQ(within_memory(sizes, 2 * limit).block, BlockRunner::kBlock);
  EXPECT_FALSE(within_memory(sizes, 2 * limit).one_field_at_a_time);
}

TEST_F(Condensed, MemoryLimitIsRespectedBeforeWorkBegins) {
  CaseConfig small = config();
  small.condensed.memory_limit_gib = 0.001;
  const auto model = value_or_fail(PreparedModel::prepare(patient(), small, Boundary::kContact));
  EXPECT_THAT(refusal_of(condense(model), ErrorCode::kInvalidArgument),
              HasSubstr("condensed.memory_limit_gib = 0.001"));
}

TEST_F(Condensed, CanBeStopped) {
  std::stop_source stop;
  stop.request_stop();
  CondenseOptions options;
  options.stop = stop.get_token();
  refusal_of(condense(prepared(Boundary::kContact), options), ErrorCode::kUnavailable);
}

TEST_F(Condensed, ProgressRunsFromZeroToOneInEveryStage) {
  std::map<std::string, std::pair<double, double>> stages;
  CondenseOptions options;
  options.progress = [&](std::string_view stage, double fraction) {
    auto [entry, first] = stages.try_emplace(std::string(stage), fraction, fraction);
    EXPECT_GE(fraction, first ? 0.0 : entry->second.second);
    entry->second.second = fraction;
  };
  ASSERT_TRUE(condense(prepared(Boundary::kContact), options));
  for (const char* stage :
       {"load modes", "prior modes", "uncertainty", "contact columns", "compact columns"}) {
    ASSERT_TRUE(stages.count(stage)) << stage;
    EXPECT_EQ(stages[stage].first, 0.0);
    EXPECT_EQ(stages[stage].second, 1.0);
  }
}

// By processes, with threads in their place: each has a part of the factor, of the columns and of
// the nodes.
TEST_F(Condensed, OfSeveralProcessesIsThatOfOne) {
  const auto one = operators(Boundary::kContact);
  for (const int processes : {2, 3}) {
    test_support::run_as_ranks(processes, [&](Ranks& ranks) {
      auto model = value_or_fail(
          PreparedModel::prepare(patient(), config(), Boundary::kContact, {}, nullptr, &ranks));
      const CondensedOperators ops = value_or_fail(condense(std::move(model)));
      const double scale = one->compliance.cwiseAbs().maxCoeff();
      EXPECT_LT((ops.compliance - one->compliance).cwiseAbs().maxCoeff(), 1e-11 * scale);
      EXPECT_EQ(ops.part_columns, one->part_columns);
      EXPECT_EQ(ops.control, one->control);
      // Modes may have other signs.
      const Eigen::MatrixXd modes = ops.region_responses.leftCols(ops.num_modes()).cast<double>();
      const Eigen::MatrixXd expected =
          one->region_responses.leftCols(one->num_modes()).cast<double>();
      const Eigen::MatrixXd covariance = expected * expected.transpose();
      EXPECT_LT((modes * modes.transpose() - covariance).norm(), 1e-5 * covariance.norm());
      EXPECT_LT((ops.truncated_variance_mm2 - one->truncated_variance_mm2).norm(),
                1e-5 * one->truncated_variance_mm2.norm());
      if (ranks.rank() > 0) {
        EXPECT_EQ(ops.responses.num_nodes(), 0);
        return;
      }
      const Eigen::MatrixXd columns =
          rows_of(ops, all_nodes(ops), ops.contact_column(0), ops.num_slaves());
      const Eigen::MatrixXd wanted =
          rows_of(*one, all_nodes(*one), one->contact_column(0), one->num_slaves());
      EXPECT_LT((columns - wanted).cwiseAbs().maxCoeff(), kFloat * wanted.cwiseAbs().maxCoeff());
    });
  }
}

TEST(PreparedModel, MoreProcessesThanTheMeshHasPartsAreRefusedWithBothNumbers) {
  const int nodes = patient()->mesh.num_nodes();
  test_support::ThreadWorld world(2 * nodes);
  test_support::ThreadRanks ranks(world, 0);
  EXPECT_THAT(refusal_of(PreparedModel::prepare(patient(), test_support::toy_config(),
                                                Boundary::kContact, {}, nullptr, &ranks),
                         ErrorCode::kInvalidArgument),
              HasSubstr("cut into " + std::to_string(nodes) + " parts"));
}

}  // namespace
}  // namespace brainshift::inversion
