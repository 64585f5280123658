// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/write_report.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "client/tools/replay/run_report.hpp"
#include "common/io/geometry/mesh_writer.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/client/tools/replay/box.hpp"
#include "tests/unit/client/tools/report/small_run.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

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
  RunReport contact = small_run("contact");
  contact.field_file = "field.vtu";
  ASSERT_TRUE(io::write_vtu(folder / "field.vtu", box_mesh(),
                            {{"displacement_estimated", box_mesh().nodes}}));
  ASSERT_TRUE(write_reports(folder / "a.json", {contact}));
  ASSERT_TRUE(write_reports(folder / "b.json", {small_run("fixed")}));
  const Status status =
      write_report({{folder / "a.json", folder / "b.json"}, folder / "deep" / "out"});
  ASSERT_TRUE(status) << status.error().message;

  const fs::path out = folder / "deep" / "out";
  const auto merged = value_or_fail(read_reports(out / "report.json"));
  ASSERT_EQ(merged.size(), 2u);
  EXPECT_EQ(merged[1].boundary, "fixed");
  EXPECT_TRUE(fs::exists(out / merged[0].field_file));  // relative to the merged report now
  for (const char* name :
       {"recovery.svg", "convergence-paper-contact.svg", "convergence-paper-fixed.svg"}) {
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
  std::string own = shortened;  // a name, no link
  for (std::size_t at; (at = own.find("http://www.w3.org/2000/svg")) != std::string::npos;) {
    own.erase(at, 26);
  }
  EXPECT_THAT(own, Not(HasSubstr("http")));
  EXPECT_THAT(shortened, Not(HasSubstr("<script")));
  EXPECT_THAT(shortened, Not(HasSubstr("url(")));
  EXPECT_THAT(shortened, HasSubstr("<svg"));
  EXPECT_LT(html.size(), 5'000'000u);
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
  ASSERT_TRUE(io::write_vtu(folder / "field.vtu", box_mesh(), {}));
  ASSERT_TRUE(write_reports(folder / "a.json", {run}));
  const Error error = refused({folder / "a.json"});
  EXPECT_EQ(error.code, ErrorCode::kUnreadable);
  EXPECT_THAT(error.message, HasSubstr("displacement_estimated"));
}

TEST_F(ReportFolder, MissingCaseFileIsNamed) {
  RunReport run = small_run("contact");
  run.field_file = "field.vtu";
  run.case_file = (folder / "gone.yaml").string();
  ASSERT_TRUE(io::write_vtu(folder / "field.vtu", box_mesh(),
                            {{"displacement_estimated", box_mesh().nodes}}));
  ASSERT_TRUE(write_reports(folder / "a.json", {run}));
  EXPECT_THAT(refused({folder / "a.json"}).message, HasSubstr("gone.yaml"));
}

TEST_F(ReportFolder, OutThatIsAFileIsRefused) {
  ASSERT_TRUE(write_reports(folder / "a.json", {small_run("contact")}));
  std::ofstream(folder / "out") << "in the way";
  refusal_of(write_report({{folder / "a.json"}, folder / "out"}), ErrorCode::kWriteFailed);
}

}  // namespace
}  // namespace brainshift::client
