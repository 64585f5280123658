// SPDX-License-Identifier: GPL-3.0-or-later
// The condensed operators in a model file.
#include <gmock/gmock.h>

#include <cstring>
#include <functional>
#include <limits>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/model/model_file_example.hpp"

namespace brainshift::io {
namespace {

using test_example::condensed_file;
using test_example::with_header;
using test_support::content_of;
using test_support::TemporaryFolder;
using testing::HasSubstr;

void expect_equal(const CondensedOperators& a, const CondensedOperators& b) {
  EXPECT_EQ(a.boundary, b.boundary);
  EXPECT_EQ(a.model_id, b.model_id);
  EXPECT_EQ(a.part_columns, b.part_columns);
  EXPECT_TRUE(a.responses.parts() == b.responses.parts());
  EXPECT_EQ(a.compliance, b.compliance);
  EXPECT_EQ(a.slave_modes, b.slave_modes);
  EXPECT_EQ(a.slave_normals, b.slave_normals);
  EXPECT_EQ(a.initial_penetration_mm, b.initial_penetration_mm);
  EXPECT_EQ(a.slaves, b.slaves);
  EXPECT_EQ(a.region, b.region);
  EXPECT_EQ(a.region_responses, b.region_responses);
  EXPECT_EQ(a.control, b.control);
  EXPECT_EQ(a.truncated_variance_mm2, b.truncated_variance_mm2);
  EXPECT_EQ(a.control_neighbours, b.control_neighbours);
  EXPECT_EQ(a.control_weights, b.control_weights);
}

TEST(CondensedFile, OperatorsAreReadBackBitForBit) {
  const TemporaryFolder folder;
  const ModelFile original = condensed_file();
  const Status written = write_model(folder / "m.h5", original);
  ASSERT_TRUE(written) << written.error().message;
  const auto read = value_or_fail(read_model(folder / "m.h5"));
  ASSERT_EQ(read.condensed.size(), 2u);
  expect_equal(read.condensed[0], original.condensed[0]);
  expect_equal(read.condensed[1], original.condensed[1]);
  ASSERT_EQ(read.inputs.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read.inputs[i].key, original.inputs[i].key);
    EXPECT_EQ(read.inputs[i].path, original.inputs[i].path);
    EXPECT_EQ(read.inputs[i].bytes, original.inputs[i].bytes);
    EXPECT_EQ(read.inputs[i].crc32, original.inputs[i].crc32);
  }
}

TEST(CondensedFile, OneBoundaryConditionMayBeMissing) {
  const TemporaryFolder folder;
  ModelFile file = condensed_file();
  file.condensed.erase(file.condensed.begin());
  ASSERT_TRUE(write_model(folder / "m.h5", file));
  const auto read = value_or_fail(read_model(folder / "m.h5"));
  ASSERT_EQ(read.condensed.size(), 1u);
  expect_equal(read.condensed[0], file.condensed[0]);
}

TEST(CondensedFile, OperatorsMayBeReadByThemselvesAndLater) {
  const TemporaryFolder folder;
  const ModelFile original = condensed_file();
  ASSERT_TRUE(write_model(folder / "m.h5", original));
  const auto bare = value_or_fail(read_model(folder / "m.h5", {}));
  EXPECT_TRUE(bare.condensed.empty());
  EXPECT_EQ(bare.model.model_id, original.model.model_id);
  const auto fixed = value_or_fail(read_operators(folder / "m.h5", bare.model, Boundary::kFixed));
  ASSERT_TRUE(fixed.has_value());
  expect_equal(*fixed, original.condensed[1]);

  ModelFile without = original;
  without.condensed.pop_back();
  ASSERT_TRUE(write_model(folder / "m.h5", without));
  const auto none = value_or_fail(read_operators(folder / "m.h5", bare.model, Boundary::kFixed));
  EXPECT_FALSE(none.has_value());
}

TEST(CondensedFile, OperatorsOfAnotherModelAreRefused) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_model(folder / "m.h5", condensed_file()));
  BrainModel other = condensed_file().model;
  other.model_id = std::string(other.model_id.size(), '0');
  EXPECT_THAT(refusal_of(read_operators(folder / "m.h5", other, Boundary::kContact),
                         ErrorCode::kUnreadable),
              HasSubstr("the operators belong to another model than '" + other.model_id));
  refusal_of(read_operators(folder / "gone.h5", other, Boundary::kContact), ErrorCode::kNotFound);
}

TEST(CondensedFile, OperatorsWithoutControlNodesAreReadBack) {
  const TemporaryFolder folder;
  ModelFile file = condensed_file();
  CondensedOperators& operators = file.condensed[0];
  operators.control.clear();
  operators.truncated_variance_mm2.resize(0, kRemainders);
  operators.control_neighbours.resize(4, 0);
  operators.control_weights.resize(4, 0);
  const Status written = write_model(folder / "m.h5", file);
  ASSERT_TRUE(written) << written.error().message;
  const auto read = value_or_fail(read_model(folder / "m.h5"));
  expect_equal(read.condensed[0], operators);
}

// More slaves than one tile of the mirrored triangle, and not a multiple of it.
TEST(CondensedFile, PackedComplianceOfManySlavesIsReadBackBitForBit) {
  const TemporaryFolder folder;
  for (const int slaves : {1, 64, 150}) {
    ModelFile file = test_example::model_file();
    file.model.mesh.nodes = Points::Random(3, 200);
    file.model.slaves.clear();
    for (int i = 0; i < slaves; ++i) file.model.slaves.push_back(i);
    file.model.model_id = content_hash(file.model);
    CondensedOperators operators;
    operators.model_id = file.model.model_id;
    operators.responses = test_example::silent_responses(200, 2 + slaves);
    operators.part_columns[0] = 2;
    operators.slaves = file.model.slaves;
    operators.compliance = Eigen::MatrixXd::Random(slaves, slaves);
    operators.compliance = (operators.compliance + operators.compliance.transpose()).eval();
    operators.slave_modes = Eigen::MatrixXd::Random(slaves, 2);
    operators.slave_normals = Points::Random(3, slaves);
    operators.initial_penetration_mm = VecX::Random(slaves);
    file.condensed = {operators};
    const Status written = write_model(folder / "m.h5", file);
    ASSERT_TRUE(written) << written.error().message;
    const auto read = value_or_fail(read_model(folder / "m.h5"));
    expect_equal(read.condensed[0], operators);
  }
}

struct Misfit {
  std::string message;
  std::function<void(CondensedOperators&)> make;
};

TEST(CondensedFile, OperatorsThatDoNotFitTheModelAreNotWritten) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  using Operators = CondensedOperators;
  const Misfit cases[] = {
      {"model_id is 'abc': the operators belong to another model than '",
       [](Operators& o) { o.model_id = "abc"; }},
      {"responses has 4 nodes: must have 5",
       [](Operators& o) { o.responses = test_example::silent_responses(4, 5); }},
      {"responses has 1 columns: fewer than the 2 slaves",
       [](Operators& o) { o.responses = test_example::silent_responses(5, 1); }},
      {"along_gravity_modes = 4: must be from 0 to the 3 modes",
       [](Operators& o) { o.part_columns[0] = 4; }},
      {"along_gravity_modes = -1: must", [](Operators& o) { o.part_columns[0] = -1; }},
      {"fine_modes = 2: must be from 0 to the 1 modes",
       [](Operators& o) { o.part_columns[test_example::kFinePart] = 2; }},
      {"responses has 1 columns of no part",
       [](Operators& o) { o.part_columns[test_example::kFinePart] = 0; }},
      {"compliance is 2 x 1: must be 2 x 2",
       [](Operators& o) { o.compliance.conservativeResize(2, 1); }},
      {"compliance is not symmetric", [](Operators& o) { o.compliance(0, 1) += 1e-9; }},
      {"slave_modes has 2 columns: must have 3",
       [](Operators& o) { o.slave_modes.conservativeResize(2, 2); }},
      {"slave_modes is 1 x 3: must be 2 x 3",
       [](Operators& o) { o.slave_modes.conservativeResize(1, 3); }},
      {"slave_normals is 3 x 3: must be 3 x 2",
       [](Operators& o) { o.slave_normals.setZero(3, 3); }},
      {"initial_penetration_mm is 1 x 1: must be 2 x 1",
       [](Operators& o) { o.initial_penetration_mm.resize(1); }},
      {"slaves names a node that is no slave", [](Operators& o) { o.slaves[0] = 1; }},
      {"slaves names a node that the mesh does not have", [](Operators& o) { o.slaves[0] = 5; }},
      {"slaves names a node that the mesh does not have", [](Operators& o) { o.slaves[1] = -1; }},
      {"slaves names a node that is no slave of the model, or more often",
       [](Operators& o) {
         o.slaves = {2, 2};
       }},
      {"region is not sorted",
       [](Operators& o) {
         o.region = {2, 0};
       }},
      {"region names a node that the mesh",
       [](Operators& o) {
         o.region = {0, 9};
       }},
      {"region_responses is 9 x 4: must be 9 x 5",
       [](Operators& o) { o.region_responses.conservativeResize(9, 4); }},
      {"region_responses is 6 x 5: must be 9 x 5",
       [](Operators& o) { o.region_responses.conservativeResize(6, 5); }},
      {"region_responses holds a number that is not finite",
       [](Operators& o) { o.region_responses(8, 4) = std::numeric_limits<float>::quiet_NaN(); }},
      {"control is not sorted",
       [](Operators& o) {
         o.control = {1, 1};
       }},
      {"truncated_variance_mm2 is 3 x 4: must be 2 x 4",
       [](Operators& o) { o.truncated_variance_mm2.setZero(3, kRemainders); }},
      {"control_neighbours is 4 x 4: must be 4 x 5",
       [](Operators& o) { o.control_neighbours.conservativeResize(4, 4); }},
      {"control_neighbours names a control node that does not exist",
       [](Operators& o) { o.control_neighbours(3, 4) = 2; }},
      {"control_neighbours names a control node that does not exist",
       [](Operators& o) { o.control_neighbours(0, 0) = -1; }},
      {"control_weights is 4 x 6: must be 4 x 5",
       [](Operators& o) { o.control_weights.setZero(4, 6); }},
      {"compliance holds a number that is not finite",
       [&](Operators& o) { o.compliance(1, 1) = nan; }},
      {"slave_modes holds a number that is not finite",
       [&](Operators& o) { o.slave_modes(0, 0) = -nan; }},
      {"slave_normals holds a number", [&](Operators& o) { o.slave_normals(2, 1) = nan; }},
      {"initial_penetration_mm holds a number",
       [](Operators& o) { o.initial_penetration_mm(0) = std::numeric_limits<double>::infinity(); }},
      {"truncated_variance_mm2 holds a number",
       [&](Operators& o) { o.truncated_variance_mm2(1, 0) = nan; }},
      {"control_weights holds a number", [&](Operators& o) { o.control_weights(3, 4) = inf; }},
  };
  const TemporaryFolder folder;
  for (const Misfit& misfit : cases) {
    ModelFile file = condensed_file();
    misfit.make(file.condensed[0]);
    EXPECT_THAT(refusal_of(write_model(folder / "m.h5", file), ErrorCode::kInvalidArgument),
                HasSubstr("m.h5: condensed/contact/" + misfit.message))
        << misfit.message;
    EXPECT_EQ(folder.entries(), 0u);
  }
}

// Where a sheet meets the skull, or two sheets one another.
TEST(CondensedFile, ASlaveOfSkullAndSheetIsThereTwice) {
  const TemporaryFolder folder;
  ModelFile file = condensed_file();
  file.model.septa.slaves = {2};
  file.model.septa.normals = Vec3::UnitX();
  file.model.model_id = content_hash(file.model);
  for (CondensedOperators& each : file.condensed) each.model_id = file.model.model_id;
  file.condensed[0].slaves = {2, 2};
  const Status written = write_model(folder / "m.h5", file);
  ASSERT_TRUE(written) << written.error().message;
  const auto read = value_or_fail(read_model(folder / "m.h5"));
  expect_equal(read.condensed[0], file.condensed[0]);
}

TEST(CondensedFile, LargestAndTinyNumbersAreFinite) {
  const TemporaryFolder folder;
  ModelFile file = condensed_file();
  using Float = std::numeric_limits<float>;
  using Double = std::numeric_limits<double>;
  file.condensed[0].control_weights.col(0) << Float::max(), Float::lowest(), Float::denorm_min(),
      -0.0f;
  file.condensed[0].slave_modes.row(0) << Double::max(), Double::lowest(), Double::denorm_min();
  ASSERT_TRUE(write_model(folder / "m.h5", file));
  const auto read = value_or_fail(read_model(folder / "m.h5"));
  expect_equal(read.condensed[0], file.condensed[0]);
}

TEST(CondensedFile, SameBoundaryTwiceIsNotWritten) {
  const TemporaryFolder folder;
  ModelFile file = condensed_file();
  file.condensed[1] = file.condensed[0];
  EXPECT_THAT(sentence_of(write_model(folder / "m.h5", file)),
              HasSubstr("two sets of operators for the boundary condition"
                        " contact"));
}

// Alters a file behind its checksum, as another program could.
class AlteredOperators : public testing::Test {
 protected:
  AlteredOperators() {
    EXPECT_TRUE(write_model(folder_ / "m.h5", condensed_file()));
    bytes_ = content_of(folder_ / "m.h5");
  }
  template <typename T>
  void replace(T value, T by) {
    const std::string stored(reinterpret_cast<const char*>(&value), sizeof value);
    const std::size_t at = bytes_.find(stored);
    ASSERT_NE(at, std::string::npos);
    std::memcpy(bytes_.data() + at, &by, sizeof by);
  }
  std::string refusal() {
    const auto read = read_model(folder_.write("changed.h5", with_header(bytes_)));
    if (read) return "";
    EXPECT_EQ(read.error().code, ErrorCode::kUnreadable);
    EXPECT_THAT(read.error().message, HasSubstr("changed.h5: is no usable model file: "));
    return read.error().message;
  }
  TemporaryFolder folder_;
  std::string bytes_;
};

TEST_F(AlteredOperators, NotFiniteNumberIsRefused) {
  replace(800.125f, std::numeric_limits<float>::quiet_NaN());
  EXPECT_THAT(refusal(), HasSubstr("condensed/contact/control_weights holds a number that is not"));
}

TEST_F(AlteredOperators, ScaleThatIsNotFiniteIsRefused) {
  replace(220.125f, std::numeric_limits<float>::infinity());
  EXPECT_THAT(refusal(), HasSubstr("condensed/contact/responses/basis_scales holds a number that"));
}

TEST_F(AlteredOperators, StepThatIsNotAboveZeroIsRefused) {
  replace(210.125f, -210.125f);
  EXPECT_THAT(refusal(), HasSubstr("condensed/contact/responses/steps holds a number that is not "
                                   "above 0"));
}

TEST_F(AlteredOperators, BlocksThatDoNotFitTheirArraysAreRefused) {
  const std::array<int, 3> stored = {5, 1, 2};
  const std::string intact = bytes_;
  replace(stored, {5, 1, 3});
  EXPECT_THAT(refusal(), HasSubstr("responses/basis has 30 numbers: must be 45"));
  bytes_ = intact;
  replace(stored, {4, 1, 2});
  EXPECT_THAT(refusal(), HasSubstr("responses/order has 5 numbers: must be 4"));
  bytes_ = intact;
  replace(stored, {5, 1, -2});
  EXPECT_THAT(refusal(), HasSubstr("responses/blocks: block 0 has 5 nodes and 1 + -2"));
}

TEST_F(AlteredOperators, NodeThatStandsTwiceInTheOrderIsRefused) {
  const std::array<int, 5> stored = {4, 2, 0, 1, 3};
  replace(stored, {4, 2, 0, 1, 4});
  EXPECT_THAT(refusal(), HasSubstr("responses/order does not name every node once"));
}

TEST_F(AlteredOperators, OtherModelIdIsRefused) {
  const std::string id = condensed_file().model.model_id;
  const std::size_t last = bytes_.rfind(id);
  ASSERT_NE(bytes_.find(id), last) << "the first one is the model's own";
  bytes_[last] = bytes_[last] == 'f' ? '0' : 'f';
  EXPECT_THAT(refusal(), HasSubstr("the operators belong to another model than '" + id));
}

TEST_F(AlteredOperators, ControlNodeThatDoesNotExistIsRefused) {
  // The first four of control_neighbours, none of whose neighbours in the file looks the same.
  const std::array<int, 4> stored = {1, 0, 0, 1};
  replace(stored, {1, 0, 0, 77});
  EXPECT_THAT(refusal(), HasSubstr("control_neighbours names a control node that does not exist"));
}

TEST_F(AlteredOperators, MissingDataSetIsNamed) {
  const std::size_t at = bytes_.find("slave_normals");
  ASSERT_NE(at, std::string::npos);
  bytes_[at + 12] = 't';  // names stay in order, as HDF5 looks them up
  EXPECT_THAT(refusal(), HasSubstr("condensed/contact/slave_normals is missing"));
}

}  // namespace
}  // namespace brainshift::io
