// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/tools/report/html_page.hpp"
#include "tests/unit/client/tools/report/small_run.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;
using testing::Not;

std::vector<ReportedRun> one(RunReport run) { return {{std::move(run), std::nullopt}}; }

// How often `part` occurs in `text`.
int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++found;
  return found;
}

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

}  // namespace
}  // namespace brainshift::client
