// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "client/report/html_page.hpp"
#include "client/report/write_report.hpp"
#include "common/io/geometry/mesh_file.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/client/replay/box.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

RunReport small_run(const char* boundary) {
  RunReport run;
  run.case_id = "box";
  run.scenario = "paper";
  run.method = "paper";
  run.boundary = boundary;
  run.updates = 1;
  run.error_mm.initial = MeanStd{2.0, 0.5};
  run.error_mm.cross = MeanStd{0.125, 0.06};
  run.recovery_pct = 93.75;
  run.craniotomy_recovery_pct = 91.0;
  run.left_out = {{"pressure", "drained", "0.02 %"}};
  run.trace = {{1, {2.0, 0.5}, MeanStd{1.9, 0.4}, 12, 0.3, 100.0},
               {2, {1.0, 0.5}, std::nullopt, 2, 0.1, 200.0}};
  return run;
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

TEST(Html, Base64MatchesTheTestVectorsOfRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe"), "//4=");
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

class ReportFolder : public testing::Test {
 protected:
  Error refused(const std::vector<fs::path>& reports) const {
    const Status status = write_report({reports, folder / "out"});
    EXPECT_FALSE(status);
    EXPECT_FALSE(fs::exists(folder / "out" / "report.html"));
    return status ? Error{} : status.error();
  }
  const test_support::TemporaryFolder folder;
};

TEST_F(ReportFolder, HoldsMergedJsonPageAndPictures) {
  const test::Box box;
  RunReport contact = small_run("contact");
  contact.field_file = "field.vtu";
  ASSERT_TRUE(io::write_vtu(folder / "field.vtu", box.mesh(),
                            {{"displacement_estimated", box.mesh().nodes}}));
  ASSERT_TRUE(write_reports(folder / "a.json", {contact}));
  ASSERT_TRUE(write_reports(folder / "b.json", {small_run("fixed")}));
  const Status status =
      write_report({{folder / "a.json", folder / "b.json"}, folder / "deep" / "out"});
  ASSERT_TRUE(status) << status.error().message;

  const fs::path out = folder / "deep" / "out";
  const auto merged = read_reports(out / "report.json");
  ASSERT_TRUE(merged) << merged.error().message;
  ASSERT_EQ(merged->size(), 2u);
  EXPECT_EQ((*merged)[1].boundary, "fixed");
  EXPECT_TRUE(fs::exists(out / (*merged)[0].field_file));  // relative to the merged report now
  for (const char* name :
       {"recovery.png", "convergence-paper-contact.png", "convergence-paper-fixed.png"}) {
    EXPECT_GT(fs::file_size(out / name), 1000u) << name;
  }
  std::stringstream page;
  page << std::ifstream(out / "report.html").rdbuf();
  const std::string html = page.str();
  const std::regex link("(src|href)=\"(?!data:)");
  std::string shortened;  // the matcher recurses; embedded images are long
  for (std::size_t at = 0; at < html.size();) {
    const std::size_t start = html.find("base64,", at);
    shortened += html.substr(at, start == std::string::npos ? start : start - at);
    if (start == std::string::npos) break;
    at = html.find('"', start);
  }
  EXPECT_FALSE(std::regex_search(shortened, link));
  EXPECT_THAT(shortened, Not(HasSubstr("http")));
  EXPECT_THAT(shortened, Not(HasSubstr("<script")));
  EXPECT_THAT(shortened, Not(HasSubstr("url(")));
  EXPECT_THAT(shortened, HasSubstr("data:image/png;"));
}

TEST_F(ReportFolder, MissingReportIsNamed) {
  const Error error = refused({folder / "nowhere.json"});
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_THAT(error.message, HasSubstr("nowhere.json"));
}

TEST_F(ReportFolder, MalformedReportIsNamed) {
  std::ofstream(folder / "bad.json") << "[{\"case\": ";
  const Error error = refused({folder / "bad.json"});
  EXPECT_EQ(error.code, ErrorCode::kUnreadable);
  EXPECT_THAT(error.message, HasSubstr("bad.json"));
  EXPECT_THAT(error.message, Not(HasSubstr("\n")));
}

TEST_F(ReportFolder, ReportWithoutRunIsRefused) {
  ASSERT_TRUE(write_reports(folder / "a.json", {}));
  EXPECT_EQ(refused({folder / "a.json"}).code, ErrorCode::kEmptySet);
  EXPECT_EQ(refused({}).code, ErrorCode::kEmptySet);
}

TEST_F(ReportFolder, NamedButMissingFieldFileIsAnError) {
  RunReport run = small_run("contact");
  run.field_file = "gone.vtu";
  ASSERT_TRUE(write_reports(folder / "a.json", {run}));
  const Error error = refused({folder / "a.json"});
  EXPECT_EQ(error.code, ErrorCode::kNotFound);
  EXPECT_THAT(error.message, HasSubstr("gone.vtu"));
}

TEST_F(ReportFolder, FieldFileWithoutTheEstimateIsAnError) {
  RunReport run = small_run("contact");
  run.field_file = "field.vtu";
  ASSERT_TRUE(io::write_vtu(folder / "field.vtu", test::Box{}.mesh(), {}));
  ASSERT_TRUE(write_reports(folder / "a.json", {run}));
  const Error error = refused({folder / "a.json"});
  EXPECT_EQ(error.code, ErrorCode::kUnreadable);
  EXPECT_THAT(error.message, HasSubstr("displacement_estimated"));
}

TEST_F(ReportFolder, MissingCaseFileIsNamed) {
  RunReport run = small_run("contact");
  run.field_file = "field.vtu";
  run.case_file = (folder / "gone.yaml").string();
  ASSERT_TRUE(io::write_vtu(folder / "field.vtu", test::Box{}.mesh(),
                            {{"displacement_estimated", test::Box{}.mesh().nodes}}));
  ASSERT_TRUE(write_reports(folder / "a.json", {run}));
  EXPECT_THAT(refused({folder / "a.json"}).message, HasSubstr("gone.yaml"));
}

TEST_F(ReportFolder, OutThatIsAFileIsRefused) {
  ASSERT_TRUE(write_reports(folder / "a.json", {small_run("contact")}));
  std::ofstream(folder / "out") << "in the way";
  const Status status = write_report({{folder / "a.json"}, folder / "out"});
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kWriteFailed);
}

}  // namespace
}  // namespace brainshift::client
