// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/tools/report/html_page.hpp"
#include "tests/unit/client/tools/report/small_run.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using testing::Not;

RunReport doubtful_run() {
  RunReport run = small_run("contact");
  run.quality = RunQuality{"unusable",
                           "caution",
                           "the time <ran> out",
                           {5, 2, 1, 0},
                           {{"deadline", 2}, {"inverted_elements", 1}, {"invented_later", 4}}};
  run.prior_strengths = {{"along_gravity", 1.25, 0.25, false}, {"other", 3.0, 0.0, true}};
  run.hypotheses = {{{{"along_gravity", 2.5}, {"other", 3.0}}, 0.6},
                    {{{"along_gravity", 0.0}, {"other", 0.0}}, 0.3},
                    {{{"along_gravity", 1.0}, {"other", 1.0}}, 0.08},
                    {{{"along_gravity", 9.0}, {"other", 9.0}}, 0.02}};
  return run;
}

TEST(QualityTable, TellsVerdictsByWordAndSignBesideTheColour) {
  const std::string table =
      quality_table({{doubtful_run(), std::nullopt}, {small_run("fixed"), std::nullopt}});
  EXPECT_THAT(table, HasSubstr("<th>worst update</th><td><span class=\"verdict unusable\">&#10005; "
                               "unusable</span></td><td><span class=\"verdict good\">&#10003; "
                               "good</span></td>"));
  EXPECT_THAT(table, HasSubstr("&#9651; caution"));
  EXPECT_THAT(table, HasSubstr("<td>5 / 2 / 1</td><td>1 / 0 / 0</td>"));
  EXPECT_THAT(table, HasSubstr("the time &lt;ran&gt; out"));
}

TEST(QualityTable, HasARowPerFlagThatOccursWithItsSentence) {
  const std::string table =
      quality_table({{doubtful_run(), std::nullopt}, {small_run("fixed"), std::nullopt}});
  EXPECT_THAT(table, HasSubstr("the time ran out before the inversion settled "
                               "<code>deadline</code></th><td>2</td><td>0</td>"));
  EXPECT_THAT(table, HasSubstr("<code>inverted_elements</code></th><td>1</td><td>0</td>"));
  EXPECT_THAT(table, HasSubstr("<code>invented_later</code></th><td>4</td><td>0</td>"));
  EXPECT_THAT(table, Not(HasSubstr("not_finite")));
}

TEST(QualityTable, ShowsStrengthsAndTheMostProbableHypotheses) {
  const std::string table = quality_table({{doubtful_run(), std::nullopt}});
  EXPECT_THAT(table, HasSubstr("<th>strength of the prior: along_gravity</th>"
                               "<td>1.25 (absent: 25 %)</td>"));
  EXPECT_THAT(table, HasSubstr("<td>3.00, at its bound</td>"));
  EXPECT_THAT(table, HasSubstr("60 %: along_gravity&nbsp;2.50, other&nbsp;3.00<br>30 %: nothing<br>"
                               "8 %: along_gravity&nbsp;1.00, other&nbsp;1.00</td>"));
  EXPECT_THAT(table, Not(HasSubstr("9.00")));
}

TEST(QualityTable, OfAReportWithoutQualityHasDashes) {
  RunReport old = small_run("contact");
  old.quality.reset();
  const std::string table = quality_table({{old, std::nullopt}});
  EXPECT_THAT(table, HasSubstr("<th>worst update</th><td>&ndash;</td>"));
}

TEST(QualityTable, StandsOnThePageInBothSchemes) {
  const ReportedRun run{doubtful_run(), std::nullopt};
  const std::string page = html_page({run}, group_runs({run}), {});
  EXPECT_THAT(page, HasSubstr("<h2>Quality of the fields</h2>"));
  for (const char* colour : {"--good:", "--caution:", "--unusable:"}) {
    const auto light = page.find(colour);
    ASSERT_NE(light, std::string::npos);
    EXPECT_GT(page.find(colour, light + 1), page.find("prefers-color-scheme: dark"));
    EXPECT_NE(page.find(colour, light + 1), std::string::npos);
  }
}

}  // namespace
}  // namespace brainshift::client
