// SPDX-License-Identifier: GPL-3.0-or-later
// The report as one self-contained HTML page: no script, no external link, images embedded.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/report/head.hpp"

namespace brainshift::client {

struct PagePicture {
  std::string png;      // file content
  std::string caption;  // plain text
  int width = 0;        // CSS pixels
  int height = 0;
};

std::string html_page(const std::vector<ReportedRun>& runs, const std::vector<RunGroup>& groups,
                      const std::vector<PagePicture>& pictures);

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

// `text` with &, <, >, " and ' replaced by their entities.
std::string escape_html(std::string_view text);

}  // namespace brainshift::client
