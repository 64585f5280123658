// SPDX-License-Identifier: GPL-3.0-or-later
// A folder with the DICOM files of one series of images, one image a file, to a volume.
//
// With the first image's position P, its directions r (of a row) and c (of a column) and the pixel
// spacings d_r (between rows) and d_c:
//   x_lps = P + i d_c r + j d_r c + k s n,   n = r x c,   s = n . (P_last - P) / (number - 1)
// in the order of the positions along n, never of file names or instance numbers; RAS = (-x, -y,
// z). Every image lies within kLargestSliceError_mm of where this puts it. Values are slope x
// stored + intercept, image by image. Uncompressed files, and those that DCMTK expands: RLE, JPEG
// (lossless too) and JPEG-LS.
// Source: DICOM PS3.3, C.7.6.2 (image plane), C.7.6.3 (pixels), C.11.1 (modality LUT).
#pragma once

#include <filesystem>
#include <string>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::io {

struct DicomSeries {
  VoxelImage image;
  std::string description;                 // (0008,103e)
  std::string frame_of_reference, series;  // UIDs; empty: not said
  std::string patient_position;  // (0018,5100) in the scanner: HFS, HFP, ...; empty: not said
  int other_files = 0;           // of the folder: no DICOM, or DICOM without an image
};

// kNotFound: no such folder. kUnreadable naming folder or file: no image, images of several series
// (listed), a damaged file, several frames or colours in one, a tag that is missing or wrong,
// frames of reference, directions, spacings or sizes that differ, two images of one place, images
// that are tilted or lie beside each other (slice_places.hpp), a gap, a compression that cannot be
// expanded.
Result<DicomSeries> read_dicom_series(const std::filesystem::path& folder);

}  // namespace brainshift::io
