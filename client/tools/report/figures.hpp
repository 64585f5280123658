// SPDX-License-Identifier: GPL-3.0-or-later
// The report's pictures. Private to client/report.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/report/head.hpp"

namespace brainshift::client {

struct Figure {
  std::string file_name;  // of the PNG
  std::string caption;    // for the page; plain text
  cv::Mat image;          // 8-bit BGR, kPixelRatio times its size on the page
};

// Misfit and penetrating nodes against iteration (the paper's Fig. 3).
Figure convergence_figure(const RunGroup& group, const RunReport& run);

// Recovery at tumour and craniotomy over all groups, contact and fixed, with the paper's values.
Figure recovery_figure(const std::vector<RunGroup>& groups, const std::vector<ReportedRun>& runs);

// Error at the tumour against the time of an update, over all runs;
// nullopt when one method made them all.
std::optional<Figure> error_time_figure(const std::vector<ReportedRun>& runs);

// Slices of one group (the paper's Fig. 4). Axial and coronal: displacement arrows with tumour
// outlines, and a close-up of the tumour. Axial, where truth is recorded: true field and
// differences, error map. Empty when no run of the group has a field.
std::vector<Figure> slice_figures(const RunGroup& group, const std::vector<ReportedRun>& runs,
                                  const Head& head);

}  // namespace brainshift::client
