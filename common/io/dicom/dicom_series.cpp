// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/dicom/dicom_series.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "common/core/text.hpp"
#include "common/io/dicom/dicom_access.hpp"
#include "common/io/dicom/dicom_segmentation.hpp"
#include "common/io/dicom/slice_places.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

constexpr double kSameDirection = 1e-4, kSameSpacing = 1e-4;
constexpr int kMaxDicomVoxelsAlong = 32767;
constexpr double kLargestStored = 65535.0;
constexpr double kWidestStep = 1.5;  // of the usual one; a wider one is a gap

struct Slice {
  fs::path file;
  std::string series, frame_of_reference, description, patient_position;
  std::array<int, 2> size{};  // columns, rows
  ImagePlane plane;
  std::vector<float> values;
};

template <typename Stored>
void take_values(const Stored* stored, std::size_t count, int bits, bool is_signed, double slope,
                 double intercept, std::vector<float>& values) {
  const auto mask = bits >= 32 ? ~std::uint32_t{0} : (std::uint32_t{1} << bits) - 1;
  const auto sign = std::uint32_t{1} << (bits - 1);
  values.reserve(count);
  for (std::size_t v = 0; v < count; ++v) {
    const std::uint32_t raw = static_cast<std::uint32_t>(stored[v]) & mask;
    const auto value = is_signed && (raw & sign) != 0
                           ? static_cast<double>(raw) - static_cast<double>(mask) - 1.0
                           : static_cast<double>(raw);
    values.push_back(static_cast<float>(slope * value + intercept));
  }
}

// Left as they are where the file has none.
Status take_rescale(DcmDataset& data, double& slope, double& intercept) {
  std::array<double, 1> number{};
  if (data.tagExists(DCM_RescaleSlope)) {
    if (!take_numbers(data, DCM_RescaleSlope, number) || number[0] == 0.0) {
      return wrong_tag("RescaleSlope (0028,1053)",
                       said(data, DCM_RescaleSlope) + ": must be finite and not 0");
    }
    slope = number[0];
  }
  if (data.tagExists(DCM_RescaleIntercept)) {
    if (!take_numbers(data, DCM_RescaleIntercept, number)) {
      return wrong_tag("RescaleIntercept (0028,1052)",
                       said(data, DCM_RescaleIntercept) + ": must be finite");
    }
    intercept = number[0];
  }
  if (std::abs(slope) * kLargestStored + std::abs(intercept) > std::numeric_limits<float>::max()) {
    return wrong_tag("RescaleSlope, RescaleIntercept (0028,1052-53)",
                     fmt::format("{:g} and {:g}: values would be too large", slope, intercept));
  }
  return {};
}

Status take_pixels(DcmDataset& data, Slice& slice) {
  Uint16 columns = 0, rows = 0, samples = 1, allocated = 0, stored = 0, is_signed = 0;
  data.findAndGetUint16(DCM_Columns, columns);
  data.findAndGetUint16(DCM_Rows, rows);
  data.findAndGetUint16(DCM_SamplesPerPixel, samples);
  data.findAndGetUint16(DCM_BitsAllocated, allocated);
  data.findAndGetUint16(DCM_BitsStored, stored);
  data.findAndGetUint16(DCM_PixelRepresentation, is_signed);
  if (columns < 1 || rows < 1 || std::max(columns, rows) > kMaxDicomVoxelsAlong) {
    return wrong_tag("Rows, Columns (0028,0010-11)", fmt::format("{} and {}: must be 1 to {}", rows,
                                                                 columns, kMaxDicomVoxelsAlong));
  }
  if (samples != 1)
    return wrong_tag("SamplesPerPixel (0028,0002)", fmt::format("{}: is a colour image", samples));
  if ((allocated != 8 && allocated != 16) || stored < 1 || stored > allocated) {
    return wrong_tag(
        "BitsAllocated, BitsStored (0028,0100-01)",
        fmt::format("{} and {}: must be 8 or 16, and at most that", allocated, stored));
  }
  slice.size = {columns, rows};
  double slope = 1.0, intercept = 0.0;
  if (Status ok = take_rescale(data, slope, intercept); !ok) return ok;
  if (Status ok = expand_pixels(data); !ok) return ok;
  const auto count = static_cast<std::size_t>(columns) * rows;
  unsigned long there = 0;
  const Uint8* bytes = nullptr;
  const Uint16* words = nullptr;
  if (allocated == 8) {
    data.findAndGetUint8Array(DCM_PixelData, bytes, &there);
  } else {
    data.findAndGetUint16Array(DCM_PixelData, words, &there);
  }
  if ((bytes == nullptr && words == nullptr) || there < count) {
    return wrong_tag("PixelData (7fe0,0010)",
                     fmt::format("has {} pixels: must be {} x {}", there, columns, rows));
  }
  if (bytes != nullptr) {
    take_values(bytes, count, stored, is_signed != 0, slope, intercept, slice.values);
  } else {
    take_values(words, count, stored, is_signed != 0, slope, intercept, slice.values);
  }
  return {};
}

// An image; nothing for DICOM without one.
Result<std::unique_ptr<Slice>> read_slice(const fs::path& file) {
  DcmFileFormat format;
  const OFCondition read = format.loadFile(file.c_str());
  if (read.bad()) return unreadable(std::string("is damaged: ") + read.text());
  DcmDataset& data = *format.getDataset();
  if (!data.tagExists(DCM_PixelData)) return nullptr;
  Sint32 frames = 1;
  if (data.tagExists(DCM_NumberOfFrames)) data.findAndGetSint32(DCM_NumberOfFrames, frames);
  if (frames != 1) {
    return wrong_tag(
        "NumberOfFrames (0028,0008)",
        fmt::format("{}: enhanced images are not read; dcm2niix makes NIfTI of them", frames));
  }
  auto slice = std::make_unique<Slice>();
  slice->file = file;
  slice->series = text_of(data, DCM_SeriesInstanceUID);
  slice->frame_of_reference = text_of(data, DCM_FrameOfReferenceUID);
  slice->description = to_utf8(text_of(data, DCM_SeriesDescription));
  slice->patient_position = text_of(data, DCM_PatientPosition);
  const auto plane = image_plane(data, data, data);
  if (!plane) return tl::unexpected(plane.error());
  slice->plane = *plane;
  if (Status ok = take_pixels(data, *slice); !ok) return tl::unexpected(ok.error());
  return slice;
}

Status check_one_series(const std::vector<Slice>& slices) {
  std::map<std::string, std::pair<std::string, int>> series;
  for (const Slice& slice : slices) {
    auto& [description, count] = series[slice.series];
    description = slice.description;
    ++count;
  }
  if (series.size() > 1) {
    std::string list;
    for (const auto& [uid, told] : series) {
      list += fmt::format("{}{} of {} images", list.empty() ? "" : ", ", in_quotes(told.first),
                          told.second);
    }
    return unreadable("holds several series: " + list + "; give a folder that holds one");
  }
  const Slice& first = slices.front();
  for (const Slice& slice : slices) {
    if (slice.frame_of_reference != first.frame_of_reference) {
      return unreadable(
          fmt::format("{} and {} differ in FrameOfReferenceUID (0020,0052), {} and {}: not slices "
                      "of one volume",
                      first.file.filename().string(), slice.file.filename().string(),
                      in_quotes(first.frame_of_reference), in_quotes(slice.frame_of_reference)));
    }
    const bool directions =
        (slice.plane.along_row - first.plane.along_row).norm() < kSameDirection &&
        (slice.plane.along_column - first.plane.along_column).norm() < kSameDirection;
    const bool spacings =
        std::abs(slice.plane.between_rows - first.plane.between_rows) < kSameSpacing &&
        std::abs(slice.plane.between_columns - first.plane.between_columns) < kSameSpacing;
    if (directions && spacings && slice.size == first.size) continue;
    return unreadable(fmt::format("{} and {} differ in {}: not slices of one volume",
                                  first.file.filename().string(), slice.file.filename().string(),
                                  !directions ? "direction"
                                  : !spacings ? "pixel spacing"
                                              : "size"));
  }
  return {};
}

// What refuses slices whose distances differ. apart[i]: between slices i and i + 1, sorted.
tl::unexpected<Error> uneven(const std::vector<SlicePlace>& places,
                             const std::vector<double>& apart) {
  std::vector<double> sorted = apart;
  std::sort(sorted.begin(), sorted.end());
  const double usual = sorted[(sorted.size() - 1) / 2];
  const auto odd = std::max_element(apart.begin(), apart.end(), [&](double a, double b) {
    return std::abs(a - usual) < std::abs(b - usual);
  });
  const auto at = static_cast<std::size_t>(odd - apart.begin());
  const std::string from = place_text(places[at]), to = place_text(places[at + 1]);
  if (*odd > kWidestStep * usual) {
    return unreadable(fmt::format(
        "a gap of {:.3f} mm between {} and {}, where {:.3f} mm are usual: is a file missing, or "
        "one of another place there?",
        *odd, from, to, usual));
  }
  return unreadable(fmt::format(
      "its {} images are not evenly spaced: {} and {} lie {:.3f} mm apart, where {:.3f} "
      "mm are usual",
      places.size(), from, to, *odd, usual));
}

// The step from slice to slice, along their normal, LPS. Precondition: sorted along it.
Result<Vec3> slice_step(const std::vector<Slice>& slices, const Vec3& normal) {
  if (slices.size() < 2) return unreadable("holds one image: must be a volume of several");
  std::vector<SlicePlace> places;
  for (const Slice& slice : slices) {
    places.push_back({slice.file.filename().string(), slice.plane.position});
  }
  std::vector<double> apart;
  for (std::size_t i = 1; i < places.size(); ++i) {
    const Vec3 step = places[i].position - places[i - 1].position;
    if (step.norm() < kLargestSliceError_mm) {
      return unreadable(fmt::format("{} and {} lie at one place: several images of each slice",
                                    place_text(places[i - 1]), place_text(places[i])));
    }
    apart.push_back(step.dot(normal));
  }
  if (Status ok = check_slice_line(places, normal); !ok) return tl::unexpected(ok.error());
  const Vec3 all = places.back().position - places.front().position;
  const double step = all.dot(normal) / static_cast<double>(apart.size());
  double depth = 0.0;
  for (std::size_t i = 0; i < apart.size(); ++i) {
    depth += apart[i];
    if (std::abs(depth - static_cast<double>(i + 1) * step) > kLargestSliceError_mm) {
      return uneven(places, apart);
    }
  }
  return Vec3(step * normal);
}

Result<DicomSeries> join(std::vector<Slice>& slices) {
  if (Status ok = check_one_series(slices); !ok) return tl::unexpected(ok.error());
  const Vec3 normal = normal_of(slices.front().plane);
  std::sort(slices.begin(), slices.end(), [&](const Slice& a, const Slice& b) {
    return a.plane.position.dot(normal) < b.plane.position.dot(normal);
  });
  const auto step = slice_step(slices, normal);
  if (!step) return tl::unexpected(step.error());
  const Slice& first = slices.front();
  DicomSeries series;
  series.description = first.description;
  series.series = first.series, series.frame_of_reference = first.frame_of_reference;
  series.patient_position = first.patient_position;
  VoxelImage& image = series.image;
  image.dims = {first.size[0], first.size[1], static_cast<int>(slices.size())};
  const Vec3 to_ras(-1.0, -1.0, 1.0);
  image.T_ras_voxel.linear().col(0) =
      to_ras.cwiseProduct(first.plane.between_columns * first.plane.along_row);
  image.T_ras_voxel.linear().col(1) =
      to_ras.cwiseProduct(first.plane.between_rows * first.plane.along_column);
  image.T_ras_voxel.linear().col(2) = to_ras.cwiseProduct(*step);
  image.T_ras_voxel.translation() = to_ras.cwiseProduct(first.plane.position);
  image.values.reserve(image.num_voxels());
  for (const Slice& slice : slices) {
    image.values.insert(image.values.end(), slice.values.begin(), slice.values.end());
  }
  return series;
}

// Of folders, and of those in them, which hold DICOM files (among their first); "" without any.
std::string below_with_dicom(std::vector<fs::path> folders) {
  constexpr std::size_t kMost = 5, kMostFolders = 1000, kMostFiles = 20;
  std::vector<std::string> found;
  const std::size_t top = folders.size();
  for (std::size_t f = 0; f < folders.size() && folders.size() < kMostFolders; ++f) {
    std::size_t looked = 0;
    bool holds = false;
    std::error_code denied;
    for (const auto& entry : fs::directory_iterator(folders[f], denied)) {
      if (f < top && entry.is_directory()) folders.push_back(entry.path());
      if (holds || looked >= kMostFiles || !entry.is_regular_file()) continue;
      ++looked;
      holds = is_dicom(entry.path());
    }
    if (holds) found.push_back(in_quotes(folders[f].string()));
  }
  if (found.empty()) return {};
  std::sort(found.begin(), found.end());
  const std::size_t shown = std::min(found.size(), kMost);
  std::string text = "; folders below do, give one of them: ";
  for (std::size_t i = 0; i < shown; ++i) text += (i == 0 ? "" : ", ") + found[i];
  return shown < found.size() ? text + fmt::format(" and {} more", found.size() - shown) : text;
}

}  // namespace

Result<DicomSeries> read_dicom_series(const fs::path& folder) {
  if (!fs::is_directory(folder)) return file_error(ErrorCode::kNotFound, folder, "is no folder");
  prepare_dcmtk();
  std::vector<fs::path> files;
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
    if (entry.is_directory()) folders.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Slice> slices;
  int others = 0;
  for (const fs::path& file : files) {
    if (!is_dicom(file)) {
      ++others;
      continue;
    }
    auto slice = read_slice(file);
    if (!slice) return file_error(file, slice.error());
    if (*slice) {
      slices.push_back(std::move(**slice));
    } else {
      ++others;
    }
  }
  if (slices.empty()) {
    return unreadable(folder, fmt::format("holds no DICOM image ({} files){}", files.size(),
                                          below_with_dicom(std::move(folders))));
  }
  auto series = join(slices);
  if (!series) return file_error(folder, series.error());
  series->other_files = others;
  return series;
}

}  // namespace brainshift::io
