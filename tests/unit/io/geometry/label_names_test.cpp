// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/label_names.hpp"

#include <gmock/gmock.h>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::UnorderedElementsAre;

TEST(LabelNames, ATableBesideTheMapIsFoundAndReadByItsHeading) {
  const test_support::TemporaryFolder folder;
  folder.write("a_dseg.tsv",
               "\xEF\xBB\xBFname\tindex\tcolor\r\nBrain-Stem\t16\t#77\r\nTumour core\t1\t\n\n");
  EXPECT_THAT(value_or_fail(label_names_beside(folder / "a_dseg.nii.gz")),
              UnorderedElementsAre(Pair(16, "Brain-Stem"), Pair(1, "Tumour core")));
  EXPECT_THAT(value_or_fail(label_names_beside(folder / "b.nii")), IsEmpty());
}

TEST(LabelNames, WhatIsWrongIsNamedWithItsLine) {
  const test_support::TemporaryFolder folder;
  const auto refusal = [&](const std::string& content) {
    return refusal_of(read_label_names(folder.write("a.tsv", content)));
  };
  EXPECT_THAT(refusal("index,name\n1,a\n"), HasSubstr("a.tsv: line 1"));
  EXPECT_THAT(refusal("index\tname\n1.5\ta\n"), HasSubstr("line 2"));
  EXPECT_THAT(refusal("index\tname\n1\ta\n1\tb\n"), HasSubstr("line 3"));
  EXPECT_THAT(refusal("index\tname\n1\n"), HasSubstr("and a name"));
  EXPECT_THAT(refusal(""), HasSubstr("a.tsv: is empty"));
  EXPECT_THAT(refusal("index\tname\n\n"), HasSubstr("a.tsv: has no row below its heading"));
}

}  // namespace
}  // namespace brainshift::io
