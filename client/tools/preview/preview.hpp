// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures of a case before it is prepared, so that a wrong side or a wrong axis is seen before
// surgery: planes with outlines on the MRI, and the surface of the brain from outside.
//
// DIR/slices-tumour.png      three planes through the tumour's centre
// DIR/slices-middle.png      three planes through the middle of what there is, where there is no
//                            tumour
// DIR/slices-craniotomy.png  three planes through the craniotomy's centre, when it has nodes
// DIR/surface.png            the brain as seen through the opening, from a side and from the front
// DIR/preview.txt            the facts, doubts and problems of case_view.hpp, a line each
//
// Outlines and surfaces show what a node of the brain's surface is to the mechanics. Whatever a
// case lacks is not drawn, and of what no surface can be made the voxels are; its first problem is
// in the subtitle. Pictures of an earlier run that are not written again are removed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/tools/preview/case_view.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"

namespace brainshift::client {

struct PreviewSummary {
  std::vector<std::string> facts;
  std::vector<std::string> doubts;
  std::vector<std::string> problems;  // each ends the preparation of the case
  std::vector<std::filesystem::path> files;
};

// Errors of view_case; kWriteFailed. A case with problems is drawn all the same.
Result<PreviewSummary> write_preview(const std::filesystem::path& case_file,
                                     const std::filesystem::path& out,
                                     const Progress& progress = {});

}  // namespace brainshift::client
