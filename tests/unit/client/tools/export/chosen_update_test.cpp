// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/chosen_update.hpp"

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "common/io/recording/surgery_file.hpp"
#include "tests/unit/client/tools/export/small_export.hpp"

namespace brainshift::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class ChooseUpdate : public SmallExport {
 protected:
  Result<ChosenUpdate> choose(const UpdateChoice& choice = {}) const {
    const auto file = io::SurgeryFile::open(path);
    EXPECT_TRUE(file);
    return choose_update(*file, path, model.mesh.num_nodes(), choice);
  }
  void expect_refused(const UpdateChoice& choice, ErrorCode code, const std::string& says) const {
    const auto chosen = choose(choice);
    ASSERT_FALSE(chosen) << says;
    EXPECT_EQ(chosen.error().code, code) << chosen.error().message;
    EXPECT_THAT(chosen.error().message, HasSubstr(says));
  }
};

TEST_F(ChooseUpdate, TheLastUsableOneIsTheDefault) {
  write_updates({message(1, Quality::kGood), message(2, Quality::kCaution, 0.5),
                 message(3, Quality::kUnusable), message(4, Quality::kNotJudged)});
  const auto chosen = choose();
  ASSERT_TRUE(chosen) << chosen.error().message;
  EXPECT_EQ(chosen->message.update.sequence, 2u);
  EXPECT_EQ(chosen->message.session_id, 41u);
  EXPECT_NEAR(chosen->time_s, 1.0, 1e-6);
  EXPECT_TRUE(chosen->message.update.estimate.displacement.isApprox(
      test_support::toy_displacement(model.mesh.nodes, 0.5), 1e-6));
}

TEST_F(ChooseUpdate, ANamedOneIsTaken) {
  write_updates({message(1, Quality::kGood), message(2, Quality::kGood)});
  EXPECT_EQ(choose({.sequence = 1})->message.update.sequence, 1u);
}

TEST_F(ChooseUpdate, AnUnusableOneNeedsToBeAllowed) {
  write_updates({message(1, Quality::kGood), message(2, Quality::kUnusable)});
  expect_refused({.sequence = 2}, ErrorCode::kInvalidArgument,
                 "update 2 is unusable (volume_lost): as the test wants it. --allow-unusable");
  EXPECT_EQ(choose({.sequence = 2, .allow_unusable = true})->message.update.sequence, 2u);
  expect_refused({.allow_unusable = true}, ErrorCode::kInvalidArgument, "needs --sequence N");
}

TEST_F(ChooseUpdate, OneThatNobodyJudgedOrAnIterateIsNotUsable) {
  auto iterate = message(2, Quality::kNotJudged);
  iterate.update.final = false;
  write_updates({message(1, Quality::kNotJudged), iterate});
  expect_refused({.sequence = 1}, ErrorCode::kInvalidArgument, "update 1 is not judged");
  expect_refused({.sequence = 2}, ErrorCode::kInvalidArgument, "update 2 is an iterate");
}

TEST_F(ChooseUpdate, WithoutAUsableOneTheLastIsTold) {
  write_updates({message(1, Quality::kNotJudged), message(2, Quality::kUnusable)});
  expect_refused({}, ErrorCode::kEmptySet,
                 "holds no usable update; the last of its 2, update 2, is unusable (volume_lost)");
}

TEST_F(ChooseUpdate, AFileOfObservationsSaysWhereFieldsComeFrom) {
  write_updates({});
  expect_refused({}, ErrorCode::kEmptySet, "holds no update: it was simulated or imported");
  expect_refused({.sequence = 1}, ErrorCode::kEmptySet, "Replay it to a brainshiftd");
}

TEST_F(ChooseUpdate, ANumberThatDoesNotOccurIsToldWithThoseThatDo) {
  write_updates({message(3, Quality::kGood), message(9, Quality::kGood)});
  expect_refused({.sequence = 4}, ErrorCode::kNotFound, "holds no update 4: has 3 to 9");
}

TEST_F(ChooseUpdate, AnUpdateThatIsAnErrorCarriesNoField) {
  auto failed = message(2, Quality::kGood);
  failed.error = Error{ErrorCode::kEmptySet, "no points"};
  write_updates({message(1, Quality::kGood), failed});
  EXPECT_EQ(choose()->message.update.sequence, 1u);
  expect_refused({.sequence = 2, .allow_unusable = true}, ErrorCode::kInvalidArgument,
                 "update 2 carries no field: no points");
}

TEST_F(ChooseUpdate, AFieldOfAnotherMeshIsRefused) {
  auto other = message(1, Quality::kGood);
  other.update.estimate.displacement.conservativeResize(3, 10);
  other.update.estimate.sd_mm.conservativeResize(10);
  write_updates({other});
  expect_refused({}, ErrorCode::kUnreadable, "displacement of 10 nodes, the model has 64");
}

TEST_F(ChooseUpdate, ABrokenRecordIsNamed) {
  write_updates({message(1, Quality::kGood), message(2, Quality::kGood)});
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  EXPECT_EQ(
      sqlite3_exec(db, "UPDATE record SET payload = x'01' WHERE id = 3", nullptr, nullptr, nullptr),
      SQLITE_OK);
  sqlite3_close(db);
  const auto chosen = choose();
  ASSERT_FALSE(chosen);
  EXPECT_THAT(chosen.error().message, AllOf(StartsWith(path.string()), HasSubstr("record 3")));
}

}  // namespace
}  // namespace brainshift::client
