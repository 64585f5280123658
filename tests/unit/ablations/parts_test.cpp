// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/ablations/parts.hpp"

#include <gmock/gmock.h>

#include <set>

#include "common/io/config/config_file.hpp"
#include "tests/support/results.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::ablations {
namespace {

using testing::HasSubstr;

CaseConfig patient() {
  return value_or_fail(surgeries::read_head(std::string(BRAINSHIFT_CASES) + "/patient-2.yaml"));
}

TEST(Parts, BeginWithTheDefaultAndHaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (const Part& part : all_parts()) names.insert(part.variant.name);
  EXPECT_EQ(names.size(), all_parts().size());
  EXPECT_EQ(all_parts().front().variant.name, kDefault);
  EXPECT_EQ(find_part("no-such"), nullptr);
}

// A name in the table that is no key would change nothing that a user can change.
TEST(Parts, ChangeTheKeysThatTheyNameAndNoOthers) {
  const CaseConfig plain = patient();
  const std::string before = io::case_config_text(plain);
  for (const Part& part : all_parts()) {
    CaseConfig changed = plain;
    if (part.variant.change) part.variant.change(changed);
    EXPECT_EQ(io::case_config_text(changed) != before, !part.keys.empty()) << part.variant.name;
    EXPECT_TRUE(validate(changed)) << part.variant.name;
  }
}

TEST(Parts, OfTheDataSeeTheTumourAlone) {
  const Part& part = *find_part("no-cortex");
  Observation tumour, cortex;
  tumour.source = "ius";
  cortex.source = "stereo";
  EXPECT_TRUE(part.variant.has_seen(tumour));
  EXPECT_FALSE(part.variant.has_seen(cortex));
}

TEST(PartsFrom, KeepTheOrderAndHaveTheDefault) {
  const auto parts = value_or_fail(parts_from({"no-medium", "fixed"}));
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(parts[0].variant.name, kDefault);
  EXPECT_EQ(parts[1].variant.name, "fixed");
}

TEST(PartsFrom, NameWhatIsUnknownAndWhatIsKnown) {
  EXPECT_THAT(refusal_of(parts_from({"fixed", "no-luck"}), ErrorCode::kNotFound),
              testing::AllOf(HasSubstr("no-luck"), HasSubstr("low-rank")));
}

}  // namespace
}  // namespace brainshift::ablations
