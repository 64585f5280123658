// SPDX-License-Identifier: GPL-3.0-or-later
// A case as pictures: planes with outlines on the MRI, and the surface of the brain from outside.
//
// Outlines and surfaces show what a node of the brain's surface is to the mechanics. 8-bit BGR
// (client/tools/pictures/canvas.hpp). Whatever a case lacks is not drawn; its first problem is in
// the subtitle.
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "client/tools/preview/case_view.hpp"

namespace brainshift::client {

// Axial, coronal and sagittal plane through a point, mm RAS. place: what is there, for the title.
cv::Mat slices_picture(const CaseView& view, const Vec3& through, const std::string& place);

// As seen through the opening, from the tumour's side, and from the front. With the fluid plane and
// the second plane (the paper's section 2.6). Precondition: the brain has a surface.
cv::Mat surface_picture(const CaseView& view);

}  // namespace brainshift::client
