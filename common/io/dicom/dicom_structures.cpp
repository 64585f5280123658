// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/dicom/dicom_structures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "common/core/text.hpp"
#include "common/io/dicom/dicom_access.hpp"
#include "common/io/dicom/dicom_segmentation.hpp"
#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

constexpr double kFarthest_mm = 1e5;

DcmItem* contour_item(DcmItem& in, const DcmTagKey& key, Sint32 number) {
  DcmItem* item = nullptr;
  in.findAndGetSequenceItem(key, item, number);
  return item;
}

Result<int> number_of(DcmItem& item, const DcmTagKey& key, const char* tag) {
  Sint32 number = 0;
  if (item.findAndGetSint32(key, number).bad()) return wrong_tag(tag, "must be a whole number");
  return number;
}

// A closed contour without its repeated end. `where`: structure and contour, for messages.
Result<Points> read_points(DcmItem& item, const std::string& where) {
  const std::string text = text_of(item, DCM_ContourData);
  std::vector<double> numbers;
  for (std::size_t at = 0; !text.empty() && at <= text.size();) {
    const std::size_t end = std::min(text.find('\\', at), text.size());
    double number = 0.0;
    const std::string_view word = trimmed(std::string_view(text).substr(at, end - at));
    if (!parse_number(word, number) || !(std::abs(number) <= kFarthest_mm)) {
      return wrong_tag("ContourData (3006,0050)",
                       fmt::format("{}: {} is no place in mm", where, in_quotes(word)));
    }
    numbers.push_back(number);
    at = end + 1;
  }
  const auto said = number_of(item, DCM_NumberOfContourPoints, "NumberOfContourPoints (3006,0046)");
  if (!said) return tl::unexpected(said.error());
  if (numbers.size() != 3 * static_cast<std::size_t>(std::max(0, *said))) {
    return wrong_tag("ContourData (3006,0050)",
                     fmt::format("{}: {} numbers for {} points", where, numbers.size(), *said));
  }
  Points points(3, static_cast<Eigen::Index>(numbers.size() / 3));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const double* const at = numbers.data() + 3 * i;
    points.col(i) = Vec3(-at[0], -at[1], at[2]);
  }
  Eigen::Index count = points.cols();
  while (count > 1 && points.col(count - 1) == points.col(0)) --count;
  return Points(points.leftCols(count));
}

Status read_contours(DcmItem& of_structure, DicomStructure& structure) {
  for (Sint32 c = 0; DcmItem* const item = contour_item(of_structure, DCM_ContourSequence, c);
       ++c) {
    const std::string where = fmt::format("structure {} {}, contour {}", structure.number,
                                          in_quotes(structure.name), c + 1);
    const std::string type = text_of(*item, DCM_ContourGeometricType);
    // Those that are combined by XOR say so since 2019; a contour within another was a hole before.
    if (type != "CLOSED_PLANAR" && type != "CLOSEDPLANAR_XOR") {
      if (structure.defect.empty()) {
        structure.defect =
            fmt::format("contour {} is {}", c + 1, type.empty() ? "of no type" : one_line(type));
      }
      continue;
    }
    auto points = read_points(*item, where);
    if (!points) return tl::unexpected(points.error());
    structure.contours.push_back(std::move(*points));
  }
  return {};
}

// Series by the frame of reference that they share: what the structures were drawn on.
using ReferencedFrames = std::map<std::string, std::vector<std::string>>;

ReferencedFrames referenced_frames(DcmDataset& data) {
  ReferencedFrames frames;
  for (Sint32 f = 0;
       DcmItem* const frame = contour_item(data, DCM_ReferencedFrameOfReferenceSequence, f); ++f) {
    auto& uids = frames[text_of(*frame, DCM_FrameOfReferenceUID)];
    for (Sint32 i = 0;
         DcmItem* const study = contour_item(*frame, DCM_RTReferencedStudySequence, i); ++i) {
      for (Sint32 k = 0;
           DcmItem* const series = contour_item(*study, DCM_RTReferencedSeriesSequence, k); ++k) {
        uids.push_back(text_of(*series, DCM_SeriesInstanceUID));
      }
    }
  }
  return frames;
}

// A structure's own, or the only one of the file where it says none.
Status take_frame(DcmItem& item, const ReferencedFrames& frames, DicomStructure& structure) {
  structure.frame_of_reference = text_of(item, DCM_ReferencedFrameOfReferenceUID);
  if (structure.frame_of_reference.empty() && frames.size() > 1) {
    return wrong_tag("ReferencedFrameOfReferenceUID (3006,0024)",
                     fmt::format("structure {} {} has none, and the file names {} frames of "
                                 "reference: which one it was drawn in cannot be told",
                                 structure.number, in_quotes(structure.name), frames.size()));
  }
  if (structure.frame_of_reference.empty() && frames.size() == 1) {
    structure.frame_of_reference = frames.begin()->first;
  }
  const auto frame = frames.find(structure.frame_of_reference);
  if (frame != frames.end()) structure.series = frame->second;
  return {};
}

Result<DicomStructures> parse_structures(DcmDataset& data) {
  if (text_of(data, DCM_SOPClassUID) != UID_RTStructureSetStorage) {
    return unreadable("is DICOM, but no structure set (RTSTRUCT)");
  }
  DicomStructures result;
  const ReferencedFrames frames = referenced_frames(data);
  const auto find = [&](int number) {
    return std::find_if(result.structures.begin(), result.structures.end(),
                        [&](const DicomStructure& one) { return one.number == number; });
  };
  for (Sint32 s = 0; DcmItem* const item = contour_item(data, DCM_StructureSetROISequence, s);
       ++s) {
    const auto number = number_of(*item, DCM_ROINumber, "ROINumber (3006,0022)");
    if (!number) return tl::unexpected(number.error());
    const std::string name = one_line(to_utf8(text_of(*item, DCM_ROIName)));
    if (find(*number) != result.structures.end()) {
      return wrong_tag("ROINumber (3006,0022)",
                       fmt::format("{} stands for {} and {}", *number,
                                   in_quotes(find(*number)->name), in_quotes(name)));
    }
    DicomStructure structure;
    structure.number = *number, structure.name = name;
    if (Status ok = take_frame(*item, frames, structure); !ok) return tl::unexpected(ok.error());
    result.structures.push_back(std::move(structure));
  }
  for (Sint32 s = 0; DcmItem* const item = contour_item(data, DCM_ROIContourSequence, s); ++s) {
    const auto number =
        number_of(*item, DCM_ReferencedROINumber, "ReferencedROINumber (3006,0084)");
    if (!number) return tl::unexpected(number.error());
    const auto structure = find(*number);
    if (structure == result.structures.end()) {
      return wrong_tag("ReferencedROINumber (3006,0084)",
                       fmt::format("{}: no structure has this number", *number));
    }
    if (Status ok = read_contours(*item, *structure); !ok) return tl::unexpected(ok.error());
  }
  for (DicomStructure& one : result.structures) {
    if (one.contours.empty() && one.defect.empty()) one.defect = "has no contour";
  }
  if (result.structures.empty()) return unreadable("holds no structure");
  return result;
}

}  // namespace

bool is_dicom_structures(const fs::path& file) {
  if (!is_dicom(file)) return false;
  prepare_dcmtk();
  DcmFileFormat format;
  if (format
          .loadFileUntilTag(file.c_str(), EXS_Unknown, EGL_noChange, DCM_MaxReadLength,
                            ERM_autoDetect, DCM_SOPInstanceUID)
          .bad()) {
    return false;
  }
  return text_of(*format.getDataset(), DCM_SOPClassUID) == UID_RTStructureSetStorage;
}

Result<DicomStructures> read_dicom_structures(const fs::path& file) {
  if (Status regular = check_regular_file(file); !regular) return tl::unexpected(regular.error());
  prepare_dcmtk();
  DcmFileFormat format;
  const OFCondition read = format.loadFile(file.c_str());
  if (read.bad()) return unreadable(file, std::string("is no DICOM, or damaged: ") + read.text());
  auto result = parse_structures(*format.getDataset());
  if (!result) return file_error(file, result.error());
  return result;
}

}  // namespace brainshift::io
