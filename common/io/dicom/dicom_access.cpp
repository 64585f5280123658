// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/dicom/dicom_access.hpp"

#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <dcmtk/oflog/oflog.h>
#include <fmt/format.h>

#include <algorithm>

#include "common/core/text.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {

void prepare_dcmtk() {
  static const bool once = [] {
    OFLog::configure(OFLogger::OFF_LOG_LEVEL);
    // A value too long for the length field of its type is written as UN (PS3.5, 6.2.2).
    dcmEnableUnknownVRConversion.set(OFTrue);
    DcmRLEDecoderRegistration::registerCodecs();
    DJDecoderRegistration::registerCodecs();
    DJLSDecoderRegistration::registerCodecs();
    return true;
  }();
  static_cast<void>(once);
}

tl::unexpected<Error> wrong_tag(const char* tag, const std::string& what) {
  return unreadable(fmt::format("{}: {}", tag, what));
}

std::string text_of(DcmItem& item, const DcmTagKey& key) {
  OFString text;
  if (item.findAndGetOFStringArray(key, text).bad()) return {};
  return {text.c_str(), text.size()};
}

std::string said(DcmItem& item, const DcmTagKey& key) { return in_quotes(text_of(item, key)); }

Result<ImagePlane> image_plane(DcmItem& place, DcmItem& orientation, DcmItem& measures) {
  std::array<double, 6> directions{};
  std::array<double, 3> position{};
  std::array<double, 2> spacing{};
  if (!take_numbers(place, DCM_ImagePositionPatient, position)) {
    return wrong_tag("ImagePositionPatient (0020,0032)",
                     said(place, DCM_ImagePositionPatient) + ": must be three numbers");
  }
  const char* const kOrientation = "ImageOrientationPatient (0020,0037)";
  if (!take_numbers(orientation, DCM_ImageOrientationPatient, directions)) {
    return wrong_tag(kOrientation,
                     said(orientation, DCM_ImageOrientationPatient) + ": must be six numbers");
  }
  if (!take_numbers(measures, DCM_PixelSpacing, spacing) ||
      !(std::min(spacing[0], spacing[1]) > 0.0)) {
    return wrong_tag("PixelSpacing (0028,0030)",
                     said(measures, DCM_PixelSpacing) + ": must be two numbers above 0");
  }
  ImagePlane plane;
  plane.position = Vec3(position[0], position[1], position[2]);
  plane.along_row = Vec3(directions[0], directions[1], directions[2]);
  plane.along_column = Vec3(directions[3], directions[4], directions[5]);
  plane.between_rows = spacing[0], plane.between_columns = spacing[1];
  const bool unit = std::abs(plane.along_row.norm() - 1.0) < 1e-3 &&
                    std::abs(plane.along_column.norm() - 1.0) < 1e-3 &&
                    std::abs(plane.along_row.dot(plane.along_column)) < 1e-3;
  if (!unit) {
    return wrong_tag(kOrientation, said(orientation, DCM_ImageOrientationPatient) +
                                       ": must be two directions of length 1 at right angles");
  }
  return plane;
}

Vec3 normal_of(const ImagePlane& plane) {
  return plane.along_row.cross(plane.along_column).normalized();
}

Status expand_pixels(DcmDataset& data) {
  if (data.chooseRepresentation(EXS_LittleEndianExplicit, nullptr).good()) return {};
  const DcmXfer syntax(data.getOriginalXfer());
  return wrong_tag("PixelData (7fe0,0010)",
                   fmt::format("is compressed ({}) in a way that cannot be expanded: let gdcmconv "
                               "--raw or dcm2niix do it",
                               syntax.getXferName()));
}

}  // namespace brainshift::io
