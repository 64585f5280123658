// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/import_case.hpp"

#include <gmock/gmock.h>

#include "tests/support/temporary_folder.hpp"
#include "tests/support/toy_journal.hpp"

namespace brainshift::client {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;

TEST(ImportCase, APreparedModelSaysWhoseItIs) {
  const TemporaryFolder folder;
  const BrainModel model = test_support::toy_model(5);
  test_support::write_toy_model(folder / "toy.h5", model);
  const auto known = load_import_case({}, folder / "toy.h5");
  ASSERT_TRUE(known) << known.error().message;
  EXPECT_LT((known->tumour_centroid() - Vec3(30, 30, 40)).norm(), 0.1);
  const io::SurgeryMeta meta = known->meta("a sweep", "a test");
  EXPECT_EQ(meta.case_id, "toy");
  EXPECT_EQ(meta.model_id, model.model_id);
  EXPECT_EQ(meta.case_file, (folder / "toy.yaml").string());
  EXPECT_EQ(meta.scenario, "a sweep");
  EXPECT_EQ(meta.software, "a test");
}

TEST(ImportCase, ExactlyOneOfTheTwoIsGiven) {
  EXPECT_TRUE(check_one_case("a.yaml", {}));
  EXPECT_TRUE(check_one_case({}, "a.h5"));
  EXPECT_THAT(check_one_case({}, {}).error().message, HasSubstr("none given"));
  EXPECT_THAT(check_one_case("a.yaml", "a.h5").error().message, HasSubstr("both given"));
}

TEST(ImportCase, WhatIsMissingIsNamed) {
  EXPECT_EQ(load_import_case({}, "nowhere.h5").error().code, ErrorCode::kNotFound);
  const auto none = load_import_case("nowhere.yaml", {});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("nowhere.yaml"));
}

}  // namespace
}  // namespace brainshift::client
