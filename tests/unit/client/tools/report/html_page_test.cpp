// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/html_page.hpp"
#include "client/tools/report/escape_html.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/client/tools/report/small_run.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using testing::Not;

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
}

}  // namespace
}  // namespace brainshift::client
