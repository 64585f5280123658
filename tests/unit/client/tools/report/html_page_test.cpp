// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

#include "client/tools/report/html_page.hpp"
#include "client/tools/report/html_table.hpp"
#include "tests/unit/client/tools/report/small_run.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using testing::Not;

// How often `part` occurs in `text`.
int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++found;
  return found;
}

TEST(Html, EscapesWhatReportsSay) {
  EXPECT_EQ(escape_html("a<b>&\"c'"), "a&lt;b&gt;&amp;&quot;c&#39;");
  ReportedRun run{small_run("contact"), std::nullopt};
  run.report.scenario = "<script>alert(1)</script>";
  run.report.failures = {{1, "internal", "<img src=x>"}};
  const std::string page = html_page({run}, group_runs({run}), {});
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("<img src=x")));
}

TEST(Html, PageSaysWhatItIsNotForAndCitesThePaper) {
  const ReportedRun run{small_run("contact"), std::nullopt};
  const std::string page = html_page({run}, group_runs({run}), {});
  EXPECT_THAT(page, HasSubstr("no medical device"));
  EXPECT_THAT(page, HasSubstr("Ji"));
  EXPECT_THAT(page, HasSubstr("0.12&nbsp;&plusmn;&nbsp;0.06"));
  EXPECT_THAT(page, HasSubstr("0.11&nbsp;&plusmn;&nbsp;0.07"));
  EXPECT_THAT(page, HasSubstr("prefers-color-scheme: dark"));
  EXPECT_THAT(page, HasSubstr("pressure"));
}

TEST(Html, PageOpensWithTheVerdict) {
  const ReportedRun run{small_run("contact"), std::nullopt};
  const std::string page = html_page({run}, group_runs({run}), {});
  EXPECT_LT(page.find("93.8 % recovered"), page.find("<h2>"));
  EXPECT_LT(page.find("recovered 93.8 %"), page.find("<h2>"));
}

TEST(Html, ASlideHasAButtonAndAnImagePerPositionAndShowsTheEstimateFirst) {
  const ReportedRun run{small_run("contact"), std::nullopt};
  PageSlide slide;
  slide.positions = {{"before", "a"}, {"estimate", "b"}, {"<truth>", "c"}};
  slide.caption = "the slice";
  const std::string page = html_page({run}, group_runs({run}), {}, {slide, slide});
  EXPECT_THAT(page, HasSubstr("id=\"slide1-2\""));
  EXPECT_THAT(page,
              HasSubstr("id=\"slide0-1\" class=\"p1\" checked><label for=\"slide0-1\">estimate"));
  EXPECT_THAT(page, HasSubstr("&lt;truth&gt;"));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("http")));
  EXPECT_EQ(count(page, "data:image/webp;"), 6);
}

RunReport doubtful_run() {
  RunReport run = small_run("contact");
  run.quality = RunQuality{"unusable",
                           "caution",
                           "the time <ran> out",
                           {5, 2, 1, 0},
                           {{"deadline", 2}, {"inverted_elements", 1}, {"invented_later", 4}}};
  run.region_known = 0.375;
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
  EXPECT_THAT(table, HasSubstr("known about the region of surgery (share)</th><td>0.38</td>"
                               "<td>&ndash;</td>"));
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

TEST(QualityTable, ARowThatNoRunHasIsLeftOut) {
  RunReport old = small_run("contact");
  old.quality.reset();
  EXPECT_THAT(quality_table({{old, std::nullopt}}), Not(HasSubstr("worst update")));
  EXPECT_THAT(quality_table({{old, std::nullopt}, {small_run("fixed"), std::nullopt}}),
              HasSubstr("<th>worst update</th><td>&ndash;</td>"));
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

std::vector<ReportedRun> one(RunReport run) { return {{std::move(run), std::nullopt}}; }

TEST(ErrorTable, HasAColumnPerRunAndThreeOfThePaper) {
  std::vector<ReportedRun> runs = one(small_run("contact"));
  runs.push_back({small_run("fixed"), std::nullopt});
  const std::string table = error_table(runs);
  const std::string heading = table.substr(0, table.find("</tr>"));
  EXPECT_EQ(count(heading, "<th>"), 3) << "the empty corner and two runs";
  EXPECT_EQ(count(heading, "<th class=\"paper\">"), 3);
}

TEST(SourceTable, HasARowPerInstrumentAndMarksContradictions) {
  RunReport run = small_run("contact");
  EXPECT_EQ(source_table(one(run)), "");
  run.sources = {{"ius", 41, 2.0, 200, 3, 31.5, 28.75, 0.125, true}, {"tracks", 42, 0.0, 20}};
  run.sources[1].consistent = false;
  const std::string table = source_table(one(run));
  EXPECT_EQ(count(table, "<tr>"), 1 + 2);
  EXPECT_THAT(table, HasSubstr("<td>ius</td><td>41</td><td>2</td><td>200</td><td>3</td>"
                               "<td>31.5 / 28.8</td><td>0.1250</td><td>yes</td>"));
  EXPECT_EQ(count(table, "<strong>no</strong>"), 1);
}

TEST(LeftOutList, NamesEachOmissionOnce) {
  const std::vector<ReportedRun> runs = {{small_run("contact"), std::nullopt},
                                         {small_run("fixed"), std::nullopt}};
  const std::string list = left_out_list(runs);
  EXPECT_EQ(count(list, "<li>"), 1);
  EXPECT_THAT(list, HasSubstr("pressure"));
  EXPECT_THAT(list, HasSubstr("0.02 %"));
  RunReport complete = small_run("contact");
  complete.left_out.clear();
  EXPECT_EQ(left_out_list(one(complete)), "");
}

TEST(FailureList, IsEmptyWithoutFailuresAndEscapesTheirText) {
  RunReport run = small_run("contact");
  EXPECT_EQ(failure_list(one(run)), "");
  run.failures = {{3, "unavailable", "no <update> in time"}};
  const std::string list = failure_list(one(run));
  EXPECT_THAT(list, HasSubstr("observation 3: no &lt;update&gt; in time (unavailable)"));
  EXPECT_THAT(list, Not(HasSubstr("<update>")));
}

ReportedRun condensed(const char* scenario, double recovered) {
  ReportedRun run{small_run("contact"), std::nullopt};
  run.report.scenario = scenario;
  run.report.method = "condensed";
  run.report.recovery_pct = recovered;
  run.report.latency_ms = LatencyPercentiles{90.0, 91.0, 92.0, 93.0};
  run.report.full_solve_ms = 30.0;
  return run;
}

TEST(Verdict, NamesTheRangeAndTheLeastBesideThePaper) {
  ReportedRun worst = condensed("joint-mixed", 81.5);
  worst.report.latency_ms->p50 = 150.0;
  const std::string text = verdict({condensed("paper", 97.25), worst, condensed("sag", 90.0)});
  EXPECT_THAT(text, HasSubstr("method condensed recovered 81.5 to 97.2 %"));
  EXPECT_THAT(text, HasSubstr("least in joint-mixed: 2.00 mm before, 0.12 mm after"));
  EXPECT_THAT(text, HasSubstr("85 % in its five patients"));
  EXPECT_THAT(text, HasSubstr("90 ms to 150 ms, 3.0 to 5.0 times one solve"));
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

TEST(Verdict, SaysNothingWithoutATruthAndCountsWhatIsUnusable) {
  ReportedRun run = condensed("live", 90.0);
  run.report.latency_ms.reset();
  run.report.updates = 4;
  run.report.quality->counts.unusable = 2;
  EXPECT_THAT(verdict({run}), HasSubstr("2 of 4 updates were unusable"));
  EXPECT_THAT(verdict({run}), Not(HasSubstr("ms")));
  run.report.recovery_pct.reset();
  EXPECT_EQ(verdict({run}), "");
}

// A real surgery: landmarks, no truth.
RunReport real_run() {
  RunReport run;
  run.case_id = run.scenario = "resect-1";
  run.method = "condensed";
  run.boundary = "contact";
  run.mesh = {100, 300, 20};
  run.updates = 1;
  run.quality = RunQuality{
      "caution",       "caution", "the data say little (0.31)", {0, 1, 0, 0}, {{"mostly_prior", 1}},
      {"mostly_prior"}};
  run.tumour_shift_mm = TumourShift{2.34, 0.21};
  run.error_mm.sparse = MeanStd{0.3, 0.1};
  run.latency_ms = LatencyPercentiles{87.4, 87.4, 87.4, 87.4};
  run.course = {{0.0, "tracks", "caution", "", 2.34, 0.21, std::nullopt, 0.3, 87.4}};
  run.leave_one_out = {
      {"tracks", "landmarks", 13, 0, {5.8, 1.0}, MeanStd{1.75, 0.5}, {1.6, 0.7}, 0.875}};
  run.sources = {{"tracks", 1, 0.0, 13, 1}};
  return run;
}

TEST(Headline, OfARealSurgeryStatesMotionErrorReasonAndWhatToDo) {
  const std::string text = headline(real_run());
  EXPECT_THAT(text, HasSubstr("<strong>2.3&nbsp;&plusmn;&nbsp;0.2&nbsp;mm</strong>; misfit 0.30"));
  EXPECT_THAT(text, HasSubstr("caution</span> because the data say little (0.31)."));
  EXPECT_THAT(text,
              HasSubstr("13 landmarks of tracks were left out and predicted from the rest to "
                        "1.6 mm, from 5.8 mm without correction; a rigid fit comes to 1.8 mm"));
  EXPECT_THAT(text, HasSubstr("Next:</strong> measure more"));
  EXPECT_THAT(text, Not(HasSubstr("truth")));
}

TEST(Headline, OfASimulatedSurgeryHasTheTruthBesideIt) {
  EXPECT_THAT(
      headline(small_run("contact")),
      HasSubstr("it moved 2.00&nbsp;mm, of which 0.12&nbsp;mm are left (93.8 % recovered)"));
}

TEST(Headline, SaysThatNoUpdateCouldBeUsed) {
  RunReport run = real_run();
  run.quality->last = "unusable";
  run.quality->last_flags = {"inverted_elements"};
  EXPECT_THAT(headline(run), HasSubstr("the figures are of the last usable one"));
  run.error_mm.sparse.reset();
  EXPECT_THAT(headline(run), HasSubstr("there is no field"));
  EXPECT_THAT(headline(run), HasSubstr("check units (mm), axes (RAS)"));
  run.updates = 0;
  EXPECT_THAT(headline(run), HasSubstr("no update came"));
}

TEST(Html, APageOfARealSurgeryHasNoDashAndNoPublishedFigures) {
  const ReportedRun run{real_run(), std::nullopt};
  const std::string page = html_page({run}, group_runs({run}), {});
  EXPECT_THAT(page, Not(HasSubstr(kNothing)));
  EXPECT_THAT(page, Not(HasSubstr("<td></td>")));
  EXPECT_THAT(page, Not(HasSubstr("class=\"paper\"")));
  EXPECT_THAT(page, HasSubstr("<h2>Left out and predicted</h2>"));
}

TEST(Html, PicturesThatDoNotFitAreNamed) {
  const ReportedRun run{small_run("contact"), std::nullopt};
  PagePicture beside;
  beside.file_name = "sd-paper.png";
  const std::string page = html_page({run}, group_runs({run}), {beside});
  EXPECT_THAT(page, HasSubstr("Beside this page, which is full, lie: sd-paper.png."));
}

TEST(Duration, HasTheUnitThatPeopleUse) {
  EXPECT_EQ(duration(4.25), "4.2 ms");
  EXPECT_EQ(duration(87.4), "87 ms");
  EXPECT_EQ(duration(999.6), "1.0 s");
  EXPECT_EQ(duration(260545.0), "4.3 min");
  EXPECT_EQ(duration(59990.0), "1.0 min");
  EXPECT_EQ(duration(7.2e6), "2.0 h");
}

TEST(SummaryTable, HasALinePerRunAndThePapers) {
  ReportedRun odd = condensed("<b>odd</b>", 50.0);
  const std::string html = summary_table({condensed("paper", 97.0), odd});
  EXPECT_EQ(count(html, "<tr>") + count(html, "<tr class"), 1 + 2 + 3);
  EXPECT_THAT(html, HasSubstr("&lt;b&gt;odd"));
  EXPECT_THAT(html, Not(HasSubstr("<b>odd")));
  // As many cells in every line as the heading has.
  const int columns = count(html.substr(0, html.find("</thead>")), "<th>");
  EXPECT_EQ(count(html, "<td>"), 5 * (columns - 1));
}

}  // namespace
}  // namespace brainshift::client
