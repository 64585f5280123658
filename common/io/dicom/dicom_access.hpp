// SPDX-License-Identifier: GPL-3.0-or-later
// What the readers of DICOM share. Includes DCMTK: for the folder's own sources.
#pragma once

#include <dcmtk/config/osconfig.h>
// DCMTK's own order.
#include <dcmtk/dcmdata/dctk.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <string>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

// DCMTK prints to stderr, knows no compression and leaves UN unread until it is told.
void prepare_dcmtk();

// kUnreadable: "NAME (gggg,eeee): what".
tl::unexpected<Error> wrong_tag(const char* tag, const std::string& what);

// An element's text; empty where there is none.
std::string text_of(DcmItem& item, const DcmTagKey& key);

// The same in quotes, for a refusal.
std::string said(DcmItem& item, const DcmTagKey& key);

// Takes all of `numbers`; false unless as many are there and finite.
template <std::size_t N>
bool take_numbers(DcmItem& item, const DcmTagKey& key, std::array<double, N>& numbers) {
  for (std::size_t i = 0; i < N; ++i) {
    const bool there =
        item.findAndGetFloat64(key, numbers[i], static_cast<unsigned long>(i)).good();
    if (!there || !std::isfinite(numbers[i])) return false;
  }
  return true;
}

// An image's plane, LPS, mm.
struct ImagePlane {
  Vec3 position = Vec3::Zero(), along_row = Vec3::Zero(), along_column = Vec3::Zero();
  double between_columns = 0.0, between_rows = 0.0;
};
// Unit.
Vec3 normal_of(const ImagePlane& plane);

// The three items hold position, directions and spacings: one item for classic images.
Result<ImagePlane> image_plane(DcmItem& position, DcmItem& orientation, DcmItem& spacing);

// Expands compressed pixels, or says that they cannot be.
Status expand_pixels(DcmDataset& data);

}  // namespace brainshift::io
