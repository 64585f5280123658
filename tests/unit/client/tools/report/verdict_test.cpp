// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/verdict.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/unit/client/tools/report/small_run.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using testing::Not;

ReportedRun condensed(const char* scenario, double recovered) {
  ReportedRun run{small_run("contact"), std::nullopt};
  run.report.scenario = scenario;
  run.report.method = "condensed";
  run.report.recovery_pct = recovered;
  run.report.latency_ms = LatencyPercentiles{90.0, 91.0, 92.0, 93.0};
  run.report.full_solve_ms = 30.0;
  return run;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

TEST(Verdict, NamesTheRangeAndTheLeastBesideThePaper) {
  ReportedRun worst = condensed("joint-mixed", 81.5);
  worst.report.latency_ms->p50 = 150.0;
  const std::string text = verdict({condensed("paper", 97.25), worst, condensed("sag", 90.0)});
  EXPECT_THAT(text, HasSubstr("method condensed recovered 81.5 to 97.2 %"));
  EXPECT_THAT(text, HasSubstr("least in joint-mixed: 2.00 mm before, 0.12 mm after"));
  EXPECT_THAT(text, HasSubstr("85 % in its five patients"));
  EXPECT_THAT(text, HasSubstr("90 to 150 ms, 3.0 to 5.0 times one solve"));
  EXPECT_THAT(text, HasSubstr("none of 3 updates was unusable"));
}

TEST(Verdict, SpeaksOfTheDefaultMethodWithContactWhereThereIsOne) {
  ReportedRun fixed = condensed("fixed-run", 10.0);
  fixed.report.boundary = "fixed";
  ReportedRun paper = condensed("paper-run", 20.0);
  paper.report.method = "paper";
  EXPECT_THAT(verdict({fixed, paper, condensed("sag", 90.0)}), HasSubstr("recovered 90.0 %"));
  EXPECT_THAT(verdict({fixed, paper}), HasSubstr("method paper recovered 20.0 %"));
  EXPECT_THAT(verdict({fixed}),
              HasSubstr("Without brain-skull contact, method condensed recovered 10.0 %"));
}

TEST(Verdict, SaysWhatIsUnknownAndWhatIsUnusable) {
  ReportedRun run = condensed("live", 0.0);
  run.report.recovery_pct.reset();
  run.report.latency_ms.reset();
  run.report.updates = 4;
  run.report.quality->counts.unusable = 2;
  const std::string text = verdict({run});
  EXPECT_THAT(text, HasSubstr("because no truth was recorded"));
  EXPECT_THAT(text, HasSubstr("2 of 4 updates were unusable"));
  EXPECT_THAT(text, Not(HasSubstr("ms")));
  run.report.updates = 0;
  EXPECT_THAT(verdict({run}), HasSubstr("no update came"));
}

TEST(SummaryTable, HasALinePerRunAndThePapers) {
  ReportedRun odd = condensed("<b>odd</b>", 50.0);
  const std::string html = summary_table({condensed("paper", 97.0), odd});
  EXPECT_EQ(count_of(html, "<tr>") + count_of(html, "<tr class"), 1u + 2u + 3u);
  EXPECT_THAT(html, HasSubstr("&lt;b&gt;odd"));
  EXPECT_THAT(html, Not(HasSubstr("<b>odd")));
  // As many cells in every line as the heading has.
  const std::size_t columns = count_of(html.substr(0, html.find("</thead>")), "<th>");
  EXPECT_EQ(count_of(html, "<td>"), 5u * (columns - 1));
}

}  // namespace
}  // namespace brainshift::client
