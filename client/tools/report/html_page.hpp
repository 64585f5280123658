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

// How the page opens: what the runs come to in a sentence of plain text.
//
// The sentence speaks of the runs with the contact boundary condition and the default method
// (condensed) that moved a tumour; without such runs of those with contact, without these of all.
// It says the motion of the tumour that was recovered (recovery_pct; the least by name), the time
// of an update over one solve (latency_ms.p50 / full_solve_ms), and how many updates were unusable,
// each beside the paper's figure. What no run has measured is left out of it.
std::string verdict(const std::vector<ReportedRun>& runs);

// The page's parts, as HTML. First a table that fits the window: a line per run, twelve columns
// with their units, the paper's figures as the last lines.
std::string summary_table(const std::vector<ReportedRun>& runs);
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
