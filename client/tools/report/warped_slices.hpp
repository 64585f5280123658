// SPDX-License-Identifier: GPL-3.0-or-later
// The MRI slice as it was, as the estimate moves it, and as the truth does: pictures of one size
// that the page lays on each other. Private to client/report.
//
// A pixel at x in the deformed head shows the image at X with X + u(X) = x: X is found in the mesh
// whose nodes are moved by u. Where the moved brain has left a place it is black; outside the
// brain the image is as it was.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/report/head.hpp"

namespace brainshift::client {

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
