// SPDX-License-Identifier: GPL-3.0-or-later
// The report as one self-contained HTML page: no script, no external link, images embedded.
#pragma once

#include <string>
#include <vector>

#include "client/tools/report/head.hpp"

namespace brainshift::client {

struct PagePicture {
  std::string png;      // file content
  std::string caption;  // plain text
  int width = 0;        // CSS pixels
  int height = 0;
};

// Pictures of one size on each other, of which the reader chooses one: radio buttons and a style
// sheet, so that the page needs no script.
struct PageSlide {
  struct Position {
    std::string label;  // plain text
    std::string png;
  };
  std::vector<Position> positions;  // the second is shown first: the estimate
  std::string caption;
  int width = 0, height = 0;
};

// The page opens with verdict() and summary_table(), the slides, and pictures; details follow.
std::string html_page(const std::vector<ReportedRun>& runs, const std::vector<RunGroup>& groups,
                      const std::vector<PagePicture>& pictures,
                      const std::vector<PageSlide>& slides = {});

// The page's parts, as HTML.
std::string error_table(const std::vector<ReportedRun>& runs);  // beside the paper's values
// Verdicts and flags of each run's updates; strengths of the prior of the last usable one.
std::string quality_table(const std::vector<ReportedRun>& runs);
std::string timing_table(const std::vector<ReportedRun>& runs);
std::string left_out_list(const std::vector<ReportedRun>& runs);
// One row per instrument of each run's last update; empty when no update had named sources.
std::string source_table(const std::vector<ReportedRun>& runs);
// Empty when nothing failed.
std::string failure_list(const std::vector<ReportedRun>& runs);

}  // namespace brainshift::client
