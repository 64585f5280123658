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
  std::string file_name;  // of the PNG or SVG
  std::string caption;    // for the page; plain text
  cv::Mat image = {};     // 8-bit BGR, kPixelRatio times its size on the page; empty: a chart
  std::string svg = {};   // of a chart
};

// Misfit and penetrating nodes against iteration (the paper's Fig. 3); nullopt below two
// iterations.
std::optional<Figure> convergence_figure(const RunGroup& group, const RunReport& run);

// A strip per quantity over the course of a run: motion of the tumour with its standard deviation,
// beside the true one where it is recorded; misfit; time of the update. Below two updates: none.
std::vector<Figure> course_figures(const RunGroup& group, const RunReport& run);

// Recovery at tumour and craniotomy over all groups, contact and fixed, with the paper's values;
// nullopt where no run has a truth.
std::optional<Figure> recovery_figure(const std::vector<RunGroup>& groups,
                                      const std::vector<ReportedRun>& runs);

// Error at the tumour against the time of an update, over all runs;
// nullopt when one method made them all.
std::optional<Figure> error_time_figure(const std::vector<ReportedRun>& runs);

// Slices of one group (the paper's Fig. 4). Axial and coronal: displacement arrows with tumour
// outlines, and a close-up of the tumour. Axial: maps of the standard deviation and of what the
// data know, where a run has them; where truth is recorded, true field and differences, error
// map. Empty when no run of the group has a field.
std::vector<Figure> slice_figures(const RunGroup& group, const std::vector<ReportedRun>& runs,
                                  const Head& head);

// The MRI slice as it was, as the estimate moves it, and as the truth does: pictures of one size
// that the page lays on each other.
//
// A pixel at x in the deformed head shows the image at X with X + u(X) = x: X is found in the mesh
// whose nodes are moved by u. Where the moved brain has left a place it is black; outside the
// brain the image is as it was.
struct SlidePosition {
  std::string label;  // "before", "estimate", "truth"
  cv::Mat image;      // 8-bit BGR
};

struct Slide {
  std::string file_name;  // unique in the report; "-LABEL.png" is added for each position
  std::string caption;    // plain text
  std::vector<SlidePosition> positions;
};

// Axial and coronal, through the tumour's centre; two positions where no truth is recorded. Of the
// group's run with contact, or else of the fixed one. Empty without a field or an MRI.
std::vector<Slide> warped_slices(const RunGroup& group, const std::vector<ReportedRun>& runs,
                                 const Head& head);

}  // namespace brainshift::client
