// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/dicom_files.hpp"

#include <dcmtk/config/osconfig.h>
// DCMTK's own order.
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <utility>

namespace brainshift::test_support {
namespace {

namespace fs = std::filesystem;

void check(const OFCondition& condition) {
  if (condition.bad()) throw std::runtime_error(condition.text());
}

void put(DcmItem& item, const DcmTagKey& key, const std::string& value) {
  check(item.putAndInsertString(key, value.c_str()));
}
void put(DcmItem& item, const DcmTagKey& key, int value) {
  check(item.putAndInsertUint16(key, static_cast<Uint16>(value)));
}

DcmItem& add_item(DcmItem& in, const DcmTagKey& key) {
  DcmItem* item = nullptr;
  check(in.findOrCreateSequenceItem(key, item, -2));  // -2: a new one
  return *item;
}

std::string lps(const Vec3& ras) {
  return fmt::format("{:.6f}\\{:.6f}\\{:.6f}", -ras.x(), -ras.y(), ras.z());
}

void save(DcmFileFormat& format, const fs::path& file, const char* sop_class,
          const std::string& instance) {
  put(*format.getDataset(), DCM_SOPClassUID, sop_class);
  put(*format.getDataset(), DCM_SOPInstanceUID, instance);
  check(format.saveFile(file.c_str(), EXS_LittleEndianExplicit));
}

// Of slices along k.
void put_orientation(DcmItem& item, const VoxelImage& image) {
  const Mat3 axes = image.T_ras_voxel.linear();
  put(item, DCM_ImageOrientationPatient,
      lps(axes.col(0).normalized()) + "\\" + lps(axes.col(1).normalized()));
}
void put_spacing(DcmItem& item, const VoxelImage& image) {
  const Mat3 axes = image.T_ras_voxel.linear();
  put(item, DCM_PixelSpacing,
      fmt::format("{:.6f}\\{:.6f}", axes.col(1).norm(), axes.col(0).norm()));
}

}  // namespace

void write_structure_set(const fs::path& file, const StructureSet& set) {
  DcmFileFormat format;
  DcmDataset& data = *format.getDataset();
  const auto refer = [&data](const std::string& uid, const std::string& series_uid) {
    DcmItem& frame = add_item(data, DCM_ReferencedFrameOfReferenceSequence);
    put(frame, DCM_FrameOfReferenceUID, uid);
    DcmItem& series =
        add_item(add_item(frame, DCM_RTReferencedStudySequence), DCM_RTReferencedSeriesSequence);
    put(series, DCM_SeriesInstanceUID, series_uid);
  };
  if (!set.other_frame.empty()) refer(set.other_frame, "1.2.88");
  refer(set.frame_of_reference, set.series);
  for (const DrawnStructure& structure : set.structures) {
    DcmItem& roi = add_item(data, DCM_StructureSetROISequence);
    put(roi, DCM_ROINumber, std::to_string(structure.number));
    put(roi, DCM_ReferencedFrameOfReferenceUID,
        structure.frame_of_reference.empty() ? set.frame_of_reference
                                             : structure.frame_of_reference);
    put(roi, DCM_ROIName, structure.name);
    DcmItem& drawn = add_item(data, DCM_ROIContourSequence);
    put(drawn, DCM_ReferencedROINumber, std::to_string(structure.number));
    for (const DrawnContour& contour : structure.contours) {
      DcmItem& item = add_item(drawn, DCM_ContourSequence);
      put(item, DCM_ContourGeometricType, contour.type);
      put(item, DCM_NumberOfContourPoints,
          std::to_string(contour.points_said < 0 ? contour.points.cols() : contour.points_said));
      std::string numbers;
      for (const auto& point : contour.points.colwise()) {
        numbers += (numbers.empty() ? "" : "\\") + lps(point);
      }
      put(item, DCM_ContourData, numbers);
    }
  }
  save(format, file, UID_RTStructureSetStorage, "1.2.3.9");
}

void write_series(const fs::path& folder, const VoxelImage& image) {
  const std::size_t size =
      static_cast<std::size_t>(image.dims[0]) * static_cast<std::size_t>(image.dims[1]);
  for (int k = 0; k < image.dims[2]; ++k) {
    DcmFileFormat format;
    DcmDataset& data = *format.getDataset();
    put(data, DCM_SeriesInstanceUID, "1.2.3");
    put(data, DCM_FrameOfReferenceUID, "1.2.3.4");
    put(data, DCM_ImagePositionPatient, lps(image.T_ras_voxel * Vec3(0, 0, k)));
    put_orientation(data, image);
    put_spacing(data, image);
    put(data, DCM_SamplesPerPixel, 1);
    put(data, DCM_Rows, image.dims[1]);
    put(data, DCM_Columns, image.dims[0]);
    put(data, DCM_BitsAllocated, 16);
    put(data, DCM_BitsStored, 16);
    put(data, DCM_HighBit, 15);
    put(data, DCM_PixelRepresentation, 1);
    std::vector<Uint16> pixels;
    for (std::size_t v = 0; v < size; ++v) {
      const float value = image.values[static_cast<std::size_t>(k) * size + v];
      pixels.push_back(static_cast<Uint16>(static_cast<std::int16_t>(std::lround(value))));
    }
    check(data.putAndInsertUint16Array(DCM_PixelData, pixels.data(), pixels.size()));
    // Names against the order of the slices.
    save(format, folder / fmt::format("{:04d}.dcm", image.dims[2] - k), UID_MRImageStorage,
         fmt::format("1.2.3.{}", 100 + k));
  }
}

void write_segmentation(const fs::path& file, const VoxelImage& labels,
                        const std::map<int, std::string>& names) {
  DcmFileFormat format;
  DcmDataset& data = *format.getDataset();
  put(data, DCM_SamplesPerPixel, 1);
  put(data, DCM_Rows, labels.dims[1]);
  put(data, DCM_Columns, labels.dims[0]);
  put(data, DCM_BitsAllocated, 1);
  DcmItem& shared = add_item(data, DCM_SharedFunctionalGroupsSequence);
  put_orientation(add_item(shared, DCM_PlaneOrientationSequence), labels);
  DcmItem& measures = add_item(shared, DCM_PixelMeasuresSequence);
  put_spacing(measures, labels);
  put(measures, DCM_SliceThickness,
      fmt::format("{:.6f}", labels.T_ras_voxel.linear().col(2).norm()));
  std::vector<Uint8> bytes;
  std::size_t bits = 0;
  int frames = 0;
  for (const auto& [label, name] : names) {
    DcmItem& segment = add_item(data, DCM_SegmentSequence);
    put(segment, DCM_SegmentNumber, label);
    put(segment, DCM_SegmentLabel, name);
    for (int k = 0; k < labels.dims[2]; ++k) {
      std::vector<bool> slice;
      bool any = false;
      for (int j = 0; j < labels.dims[1]; ++j) {
        for (int i = 0; i < labels.dims[0]; ++i) {
          slice.push_back(std::lround(labels.at(i, j, k)) == label);
          any = any || slice.back();
        }
      }
      if (!any) continue;
      ++frames;
      DcmItem& own = add_item(data, DCM_PerFrameFunctionalGroupsSequence);
      put(add_item(own, DCM_PlanePositionSequence), DCM_ImagePositionPatient,
          lps(labels.T_ras_voxel * Vec3(0, 0, k)));
      put(add_item(own, DCM_SegmentIdentificationSequence), DCM_ReferencedSegmentNumber, label);
      for (const bool bit : slice) {
        if (bits % 8 == 0) bytes.push_back(0);
        if (bit) bytes.back() = static_cast<Uint8>(bytes.back() | (1U << (bits % 8)));
        ++bits;
      }
    }
  }
  if (bytes.size() % 2 != 0) bytes.push_back(0);
  put(data, DCM_NumberOfFrames, std::to_string(frames));
  check(data.putAndInsertUint8Array(DCM_PixelData, bytes.data(), bytes.size()));
  save(format, file, UID_SegmentationStorage, "1.2.3.8");
}

std::vector<DrawnContour> outlines(const VoxelImage& labels, int label) {
  using Middle = std::pair<int, int>;  // twice its place, in voxels
  // Inside is on the left. Corners of a cell: 1 at (i, j), 2 at (i + 1, j), 4 at (i + 1, j + 1), 8
  // at (i, j + 1). Sides: 0 below, 1 right, 2 above, 3 left.
  static const std::vector<std::pair<int, int>> kSteps[16] = {
      {},       {{0, 3}}, {{1, 0}}, {{1, 3}}, {{2, 1}},         {{0, 3}, {2, 1}},
      {{2, 0}}, {{2, 3}}, {{3, 2}}, {{0, 2}}, {{1, 0}, {3, 2}}, {{1, 2}},
      {{3, 1}}, {{0, 1}}, {{3, 0}}, {}};
  std::vector<DrawnContour> contours;
  for (int k = 0; k < labels.dims[2]; ++k) {
    const auto inside = [&](int i, int j) {
      return i >= 0 && j >= 0 && i < labels.dims[0] && j < labels.dims[1] &&
             std::lround(labels.at(i, j, k)) == label;
    };
    std::map<Middle, Middle> next;
    for (int j = -1; j < labels.dims[1]; ++j) {
      for (int i = -1; i < labels.dims[0]; ++i) {
        const int corners = (inside(i, j) ? 1 : 0) + (inside(i + 1, j) ? 2 : 0) +
                            (inside(i + 1, j + 1) ? 4 : 0) + (inside(i, j + 1) ? 8 : 0);
        const Middle sides[4] = {
            {2 * i + 1, 2 * j}, {2 * i + 2, 2 * j + 1}, {2 * i + 1, 2 * j + 2}, {2 * i, 2 * j + 1}};
        for (const auto& [from, to] : kSteps[corners]) next[sides[from]] = sides[to];
      }
    }
    while (!next.empty()) {
      std::vector<Vec3> points;
      for (auto at = next.begin(); at != next.end();) {
        points.push_back(labels.T_ras_voxel *
                         Vec3(0.5 * at->first.first, 0.5 * at->first.second, k));
        const Middle to = at->second;
        next.erase(at);
        at = next.find(to);
      }
      contours.push_back({columns_of(points)});
    }
  }
  return contours;
}

}  // namespace brainshift::test_support
