// SPDX-License-Identifier: GPL-3.0-or-later
// The report as one self-contained HTML page: no script, no external link, pictures embedded.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/tools/report/head.hpp"

namespace brainshift::client {

struct PagePicture {
  std::string caption;  // plain text
  std::string svg;      // a chart; else
  std::string webp;     // file content; empty: beside the page only, as file_name
  std::string file_name;
  int width = 0;  // CSS pixels, of a WebP
  int height = 0;
  std::optional<std::size_t> group;  // whose section it stands in; else that of all runs
};

// Pictures of one size on each other, of which the reader chooses one: radio buttons and a style
// sheet, so that the page needs no script.
struct PageSlide {
  struct Position {
    std::string label;  // plain text
    std::string webp;
  };
  std::vector<Position> positions;  // the second is shown first: the estimate
  std::string caption;
  int width = 0, height = 0;
  std::size_t group = 0;
};

// The page opens with a headline per group (of its run with contact, or else the fixed one), the
// verdict and the table in short. A section per group has its pictures; details follow. What no run
// has is left out: neither an empty column, row or chart, nor a dash in its place.
std::string html_page(const std::vector<ReportedRun>& runs, const std::vector<RunGroup>& groups,
                      const std::vector<PagePicture>& pictures,
                      const std::vector<PageSlide>& slides = {});

// What a run says, as paragraphs of HTML: how far the tumour moved, with its standard deviation,
// the misfit and the verdict on the last update with its reason; the truth beside it, or what was
// left out and predicted; and what to do next.
std::string headline(const RunReport& run);

// What all runs come to against their truths in a sentence of plain text; empty where none has one.
//
// The sentence speaks of the runs with the contact boundary condition and the default method
// (condensed) that moved a tumour; without such runs of those with contact, without these of all.
// It says the motion of the tumour that was recovered (recovery_pct; the least by name), the time
// of an update over one solve (latency_ms.p50 / full_solve_ms), and how many updates were unusable,
// each beside the paper's figure. What no run has measured is left out of it.
std::string verdict(const std::vector<ReportedRun>& runs);

// The page's parts, as HTML. First a line per run, with the columns that any run has, and where one
// has a truth the paper's figures as the last lines.
std::string summary_table(const std::vector<ReportedRun>& runs);
// Where a run has a truth beside the paper's values.
std::string error_table(const std::vector<ReportedRun>& runs);
// A row per source that was left out; empty when none was.
std::string left_out_table(const std::vector<ReportedRun>& runs);
// Verdicts and flags of each run's updates; strengths of the prior of the last usable one.
std::string quality_table(const std::vector<ReportedRun>& runs);
std::string timing_table(const std::vector<ReportedRun>& runs);
std::string left_out_list(const std::vector<ReportedRun>& runs);
// One row per instrument of each run's last update; empty when no update had named sources.
std::string source_table(const std::vector<ReportedRun>& runs);
// Empty when nothing failed.
std::string failure_list(const std::vector<ReportedRun>& runs);

}  // namespace brainshift::client
