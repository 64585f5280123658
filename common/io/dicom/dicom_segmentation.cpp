// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/dicom/dicom_segmentation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <string_view>

#include "common/core/text.hpp"
#include "common/io/dicom/dicom_access.hpp"
#include "common/io/dicom/slice_places.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

constexpr Sint32 kMostFrames = 100000;
constexpr int kMaxSegVoxelsAlong = 32767;

struct Frame {
  ImagePlane plane;
  std::size_t number = 0;  // from 0, as it lies in the file
  int segment = 0;
  double thickness = 0.0, depth = 0.0;
};

DcmItem* item_of(DcmItem* group, const DcmTagKey& key, Sint32 number = 0) {
  DcmItem* item = nullptr;
  if (group != nullptr) group->findAndGetSequenceItem(key, item, number);
  return item;
}

Result<Frame> read_frame(DcmDataset& data, Sint32 number) {
  DcmItem* const shared = item_of(&data, DCM_SharedFunctionalGroupsSequence);
  DcmItem* const own = item_of(&data, DCM_PerFrameFunctionalGroupsSequence, number);
  const auto group = [&](const DcmTagKey& key) {
    DcmItem* const item = item_of(own, key);
    return item != nullptr ? item : item_of(shared, key);
  };
  DcmItem* const place = group(DCM_PlanePositionSequence);
  DcmItem* const orientation = group(DCM_PlaneOrientationSequence);
  DcmItem* const measures = group(DCM_PixelMeasuresSequence);
  DcmItem* const segment = group(DCM_SegmentIdentificationSequence);
  if (place == nullptr || orientation == nullptr || measures == nullptr || segment == nullptr) {
    return unreadable(fmt::format("frame {} has no {}", number + 1,
                                  place == nullptr         ? "plane position"
                                  : orientation == nullptr ? "plane orientation"
                                  : measures == nullptr    ? "pixel measures"
                                                           : "segment"));
  }
  Frame frame;
  const auto plane = image_plane(*place, *orientation, *measures);
  if (!plane) return tl::unexpected(plane.error());
  frame.plane = *plane;
  Uint16 referenced = 0;
  segment->findAndGetUint16(DCM_ReferencedSegmentNumber, referenced);
  frame.segment = referenced;
  std::array<double, 1> thickness{};
  if (take_numbers(*measures, DCM_SpacingBetweenSlices, thickness) ||
      take_numbers(*measures, DCM_SliceThickness, thickness)) {
    frame.thickness = thickness[0];
  }
  return frame;
}

// Names the first frame that differs from frame 1 in what all slices of a volume share.
Status check_parallel(const std::vector<Frame>& frames) {
  const ImagePlane& first = frames.front().plane;
  for (const Frame& frame : frames) {
    const ImagePlane& plane = frame.plane;
    const bool parallel = (plane.along_row - first.along_row).norm() < 1e-4 &&
                          (plane.along_column - first.along_column).norm() < 1e-4;
    const bool spacings = std::abs(plane.between_rows - first.between_rows) < 1e-4 &&
                          std::abs(plane.between_columns - first.between_columns) < 1e-4;
    if (parallel && spacings) continue;
    return unreadable(fmt::format(
        "frames 1 and {} differ in {}: not slices of one volume", frame.number + 1,
        !parallel ? "ImageOrientationPatient (0020,0037)" : "PixelSpacing (0028,0030)"));
  }
  return {};
}

SlicePlace place_of(const Frame& frame) {
  return {fmt::format("frame {}", frame.number + 1), frame.plane.position};
}

// Precondition: sorted by depth.
Status check_one_frame_a_place(const std::vector<Frame>& frames) {
  std::map<int, const Frame*> last;  // of each segment
  for (const Frame& frame : frames) {
    const Frame*& before = last[frame.segment];
    if (before != nullptr && frame.depth - before->depth < kLargestSliceError_mm) {
      return unreadable(fmt::format("{} and {} of segment {} lie at one place",
                                    place_text(place_of(*before)), place_text(place_of(frame)),
                                    frame.segment));
    }
    before = &frame;
  }
  return {};
}

// Fills in the depths along the normal, from 0, and gives the step between slices.
Result<double> slice_step_of(std::vector<Frame>& frames) {
  if (Status ok = check_parallel(frames); !ok) return tl::unexpected(ok.error());
  const Vec3 normal = normal_of(frames.front().plane);
  std::vector<SlicePlace> places;
  for (const Frame& frame : frames) places.push_back(place_of(frame));
  if (Status ok = check_slice_line(places, normal); !ok) return tl::unexpected(ok.error());
  for (Frame& frame : frames) frame.depth = frame.plane.position.dot(normal);
  std::stable_sort(frames.begin(), frames.end(),
                   [](const Frame& a, const Frame& b) { return a.depth < b.depth; });
  const double lowest = frames.front().depth;
  for (Frame& frame : frames) frame.depth -= lowest;
  if (Status ok = check_one_frame_a_place(frames); !ok) return tl::unexpected(ok.error());
  double step = frames.front().thickness;
  const bool given = step > 0.0;
  if (!given) {
    step = std::numeric_limits<double>::infinity();
    for (std::size_t f = 1; f < frames.size(); ++f) {
      const double apart = frames[f].depth - frames[f - 1].depth;
      if (apart > kLargestSliceError_mm) step = std::min(step, apart);
    }
  }
  if (!std::isfinite(step)) return unreadable("says nowhere how thick its slices are");
  for (const Frame& frame : frames) {
    if (std::abs(frame.depth - std::round(frame.depth / step) * step) > kLargestSliceError_mm) {
      return unreadable(fmt::format(
          "{} lies {:.3f} mm from {}: no multiple of {}, {:.3f} mm", place_text(place_of(frame)),
          frame.depth, place_text(place_of(frames.front())),
          given ? "SpacingBetweenSlices (0018,0088) or SliceThickness (0018,0050)"
                : "the smallest step between frames",
          step));
    }
  }
  return step;
}

// Of all frames, one behind the other.
struct Pixels {
  Sint32 count = 0;
  Uint16 columns = 0, rows = 0, allocated = 0;  // bits of a pixel: 1 or 8
  Uint16 most = 255;                            // of a fractional segmentation: all of a voxel
  const Uint8* bytes = nullptr;

  std::size_t of_frame() const { return static_cast<std::size_t>(columns) * rows; }
  bool set(std::size_t at) const {
    return allocated == 1 ? ((bytes[at / 8] >> (at % 8)) & 1) != 0
                          : bytes[at] > 0 && 2 * bytes[at] >= most;
  }
};

Result<Pixels> pixels_of(DcmDataset& data) {
  Pixels pixels;
  data.findAndGetSint32(DCM_NumberOfFrames, pixels.count);
  data.findAndGetUint16(DCM_Columns, pixels.columns);
  data.findAndGetUint16(DCM_Rows, pixels.rows);
  data.findAndGetUint16(DCM_BitsAllocated, pixels.allocated);
  data.findAndGetUint16(DCM_MaximumFractionalValue, pixels.most);
  const auto count = pixels.count;
  const auto columns = pixels.columns, rows = pixels.rows, allocated = pixels.allocated;
  if (count < 1 || count > kMostFrames || columns < 1 || rows < 1 ||
      std::max(columns, rows) > kMaxSegVoxelsAlong || (allocated != 1 && allocated != 8)) {
    return unreadable(fmt::format("has {} frames of {} x {} pixels of {} bits: must be 1 or 8 bits",
                                  count, columns, rows, allocated));
  }
  if (Status ok = expand_pixels(data); !ok) return tl::unexpected(ok.error());
  DcmElement* element = nullptr;
  Uint8* bytes = nullptr;
  data.findAndGetElement(DCM_PixelData, element);
  if (element == nullptr || element->getUint8Array(bytes).bad() || bytes == nullptr) {
    return wrong_tag("PixelData (7fe0,0010)", "is missing");
  }
  const std::size_t all = pixels.of_frame() * static_cast<std::size_t>(count);
  if (element->getLength() < (allocated == 1 ? (all + 7) / 8 : all)) {
    return wrong_tag("PixelData (7fe0,0010)",
                     fmt::format("has {} bytes, too few for {} frames of {} x {} pixels",
                                 element->getLength(), count, columns, rows));
  }
  pixels.bytes = bytes;
  return pixels;
}

// Of frames in the order of their depths, `step` apart.
Result<VoxelImage> grid_of(const std::vector<Frame>& sorted, double step, const Pixels& pixels) {
  const ImagePlane& first = sorted.front().plane;
  const Vec3 normal = normal_of(first), to_ras(-1.0, -1.0, 1.0);
  const double slices = std::round(sorted.back().depth / step) + 1.0;
  if (slices > kMaxSegVoxelsAlong) return unreadable(fmt::format("has {:.0f} slices", slices));
  VoxelImage grid;
  grid.dims = {pixels.columns, pixels.rows, static_cast<int>(slices)};
  grid.T_ras_voxel.linear().col(0) = to_ras.cwiseProduct(first.between_columns * first.along_row);
  grid.T_ras_voxel.linear().col(1) = to_ras.cwiseProduct(first.between_rows * first.along_column);
  grid.T_ras_voxel.linear().col(2) = to_ras.cwiseProduct(step * normal);
  grid.T_ras_voxel.translation() = to_ras.cwiseProduct(first.position);
  return grid;
}

Result<DicomSegmentation> parse_segmentation(DcmDataset& data) {
  if (text_of(data, DCM_SOPClassUID) != UID_SegmentationStorage) {
    return unreadable("is DICOM, but no segmentation (SEG)");
  }
  DicomSegmentation result;
  result.frame_of_reference = text_of(data, DCM_FrameOfReferenceUID);
  for (Sint32 i = 0; DcmItem* const item = item_of(&data, DCM_SegmentSequence, i); ++i) {
    Uint16 number = 0;
    item->findAndGetUint16(DCM_SegmentNumber, number);
    result.names[number] = to_utf8(text_of(*item, DCM_SegmentLabel));
  }
  const auto pixels = pixels_of(data);
  if (!pixels) return tl::unexpected(pixels.error());
  std::vector<Frame> frames;
  for (Sint32 f = 0; f < pixels->count; ++f) {
    auto frame = read_frame(data, f);
    if (!frame) return tl::unexpected(frame.error());
    if (result.names.count(frame->segment) == 0) {
      return unreadable(
          fmt::format("frame {} is of segment {}, which is not listed", f + 1, frame->segment));
    }
    frame->number = static_cast<std::size_t>(f);
    frames.push_back(*frame);
  }
  const auto step = slice_step_of(frames);
  if (!step) return tl::unexpected(step.error());
  auto grid = grid_of(frames, *step, *pixels);
  if (!grid) return tl::unexpected(grid.error());
  result.grid = std::move(*grid);
  for (const auto& [number, name] : result.names) {
    result.segments[number].resize(result.grid.num_voxels());
  }
  for (const Frame& frame : frames) {
    const std::size_t size = pixels->of_frame(), from = frame.number * size;
    const std::size_t to = size * static_cast<std::size_t>(std::round(frame.depth / *step));
    std::vector<std::uint8_t>& voxels = result.segments[frame.segment];
    for (std::size_t v = 0; v < size; ++v) {
      if (pixels->set(from + v)) voxels[to + v] = 1;
    }
  }
  return result;
}

}  // namespace

bool is_dicom(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  char head[132] = {};
  in.read(head, sizeof head);
  return in && std::string_view(head + 128, 4) == "DICM";
}

Result<DicomSegmentation> read_dicom_segmentation(const fs::path& file) {
  if (Status regular = check_regular_file(file); !regular) return tl::unexpected(regular.error());
  prepare_dcmtk();
  DcmFileFormat format;
  const OFCondition read = format.loadFile(file.c_str());
  if (read.bad()) return unreadable(file, std::string("is no DICOM, or damaged: ") + read.text());
  auto result = parse_segmentation(*format.getDataset());
  if (!result) return file_error(file, result.error());
  return result;
}

VoxelImage label_map(const DicomSegmentation& segmentation, const std::vector<int>& numbers) {
  VoxelImage map = segmentation.grid;
  map.values.assign(map.num_voxels(), 0.0F);
  for (const int number : numbers) {
    const std::vector<std::uint8_t>& voxels = segmentation.segments.at(number);
    for (std::size_t v = 0; v < voxels.size(); ++v) {
      if (voxels[v] != 0) map.values[v] = std::max(map.values[v], static_cast<float>(number));
    }
  }
  return map;
}

}  // namespace brainshift::io
