// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/init/given_tumour.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <string_view>
#include <utility>

#include "common/anatomy/brain_mesh.hpp"
#include "common/core/text.hpp"
#include "common/geometry/mask.hpp"
#include "common/geometry/misplacement.hpp"
#include "common/io/dicom/dicom_segmentation.hpp"
#include "common/io/dicom/dicom_structures.hpp"
#include "common/io/dicom/filled_contours.hpp"
#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/label_map_file.hpp"
#include "common/io/geometry/label_names.hpp"

namespace brainshift::client {
namespace {

std::set<int> labels_in(const VoxelImage& image) {
  std::set<int> labels;
  for (const float v : image.values) {
    if (std::isfinite(v) && v != 0.0F) labels.insert(static_cast<int>(std::lround(v)));
  }
  return labels;
}

struct TumourChoice {
  std::vector<int> labels = {1};
  std::string why;
};

Result<TumourChoice> named_labels(const TumourFile& given, const io::LabelNames& names) {
  TumourChoice choice{{}, "--tumour-label"};
  for (const std::string_view word : io::cells_of(given.label)) {
    double number = 0.0;
    const bool whole =
        io::parse_number(word, number) && number == std::round(number) && std::abs(number) < 1e9;
    const auto is_it = [&](const auto& name) {
      return io::lower_case(name.second) == io::lower_case(word);
    };
    const auto found = std::find_if(names.begin(), names.end(), is_it);
    if (const auto times = std::count_if(names.begin(), names.end(), is_it); !whole && times > 1) {
      return invalid(fmt::format("--tumour-label: {}: {} has {} of this name: give the number",
                                 in_quotes(word), given.file.string(), times));
    }
    if (!whole && found == names.end()) {
      std::string known;
      for (const auto& [label, name] : names) {
        known += (known.empty() ? "" : ", ") + in_quotes(name);
      }
      return invalid(fmt::format("--tumour-label: {}: must be a whole number, or a name of {} ({})",
                                 in_quotes(word), given.file.string(),
                                 known.empty() ? "there is none" : known));
    }
    choice.labels.push_back(whole ? static_cast<int>(number) : found->first);
  }
  return choice;
}

Result<TumourChoice> tumour_labels(const TumourFile& given, const VoxelImage& image) {
  if (!given.label.empty()) {
    const auto names = io::label_names_beside(given.file);
    if (!names) return tl::unexpected(names.error());
    return named_labels(given, *names);
  }
  const std::set<int> there = labels_in(image);
  if (there.size() <= 1) {
    return TumourChoice{{there.empty() ? 1 : *there.begin()}, "the only label"};
  }
  const bool brats = *there.begin() >= 1 && *there.rbegin() <= 4 && there.count(2) != 0 &&
                     there.count(3) + there.count(4) != 0;
  if (brats) {
    TumourChoice choice{{}, "labels as of BraTS: all but 2, oedema"};
    std::copy_if(there.begin(), there.end(), std::back_inserter(choice.labels),
                 [](int label) { return label != 2; });
    return choice;
  }
  // Not whole: a soft mask, which anatomy::tumour_foci judges.
  const bool whole = std::all_of(image.values.begin(), image.values.end(),
                                 [](float v) { return v == std::round(v); });
  if (!whole) return TumourChoice{{1}, "a soft mask"};
  return invalid(fmt::format("{}: has several labels; name the tumour's by --tumour-label: {}",
                             given.file.string(), anatomy::listed_labels(image)));
}

// The only one of DICOM's segments or structures (`what`), or those that were named. list: all of
// them, for a refusal.
Result<TumourChoice> only_or_named(const TumourFile& given, const io::LabelNames& names,
                                   std::string_view what,
                                   const std::function<std::string()>& list) {
  if (given.label.empty() && names.size() == 1) {
    return TumourChoice{{names.begin()->first}, fmt::format("the only {}", what)};
  }
  if (given.label.empty()) {
    return invalid(fmt::format("{}: has several {}s; name the tumour's by --tumour-label: {}",
                               given.file.string(), what, list()));
  }
  auto choice = named_labels(given, names);
  for (const int number : choice ? choice->labels : std::vector<int>()) {
    if (names.count(number) != 0) continue;
    return invalid(fmt::format("--tumour-label: {}: {} has no such {}; it has {}", number,
                               given.file.string(), what, list()));
  }
  return choice;
}

std::string listed_segments(const io::LabelNames& names) {
  std::string list;
  for (const auto& [number, name] : names) {
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", number, in_quotes(name));
  }
  return list;
}

bool lies_elsewhere(const std::string& own, const MriIdentity& mri) {
  return !own.empty() && !mri.frame_of_reference.empty() && own != mri.frame_of_reference;
}

// attribute: where `own` stands.
Status same_frame(const std::string& attribute, const std::string& own, const MriIdentity& mri) {
  if (!lies_elsewhere(own, mri)) return {};
  return invalid(fmt::format(
      "was drawn in another frame of reference than --mri: {} is {}, --mri has {} (0020,0052): its "
      "places are not those of this MRI",
      attribute, in_quotes(own), in_quotes(mri.frame_of_reference)));
}

// Without labels of which the map has no voxel: they lie within others that were chosen. All of
// them where it has none at all, which anatomy::tumour_foci refuses by name.
std::vector<int> left_in(const VoxelImage& map, const std::vector<int>& labels) {
  const std::set<int> there = labels_in(map);
  std::vector<int> left = labels;
  std::erase_if(left, [&](int label) { return there.count(label) == 0; });
  return left.empty() ? labels : left;
}

// Number, name and volume of each structure, or why it has none.
std::string listed_structures(const io::DicomStructures& set, const VoxelImage& grid,
                              const MriIdentity& mri) {
  const auto volume = [&](const io::DicomStructure& one) -> Result<double> {
    if (!one.defect.empty()) return invalid(one.defect);
    if (lies_elsewhere(one.frame_of_reference, mri)) return invalid("of another image");
    return io::contours_volume_mm3(one.contours, grid);
  };
  std::string list;
  for (const io::DicomStructure& one : set.structures) {
    const auto mm3 = volume(one);
    list += fmt::format("{}{} {} ({})", list.empty() ? "" : ", ", one.number, in_quotes(one.name),
                        mm3 ? fmt::format("{:.2f} cc", 1e-3 * *mm3) : mm3.error().message);
  }
  return list;
}

// The structures as labels, their numbers and `more`, on the grid; where several lie, the last one
// chosen.
Result<VoxelImage> structure_map(const io::DicomStructures& set, const std::vector<int>& numbers,
                                 int more, const VoxelImage& grid, const MriIdentity& mri,
                                 std::vector<std::string>& notes) {
  VoxelImage map;
  map.dims = grid.dims, map.T_ras_voxel = grid.T_ras_voxel;
  map.values.assign(grid.num_voxels(), 0.0F);
  for (const int number : numbers) {
    const auto one = std::find_if(set.structures.begin(), set.structures.end(),
                                  [&](const auto& other) { return other.number == number; });
    const std::string name = fmt::format("structure {} {}", number, in_quotes(one->name));
    if (Status same =
            same_frame("ReferencedFrameOfReferenceUID (3006,0024)", one->frame_of_reference, mri);
        !same) {
      return invalid(name + ": " + same.error().message);
    }
    if (!one->defect.empty()) {
      return invalid(fmt::format("{}: {}: closed planar contours are needed", name, one->defect));
    }
    const auto filled = io::fill_contours(one->contours, grid);
    if (!filled) return fail(filled.error().code, name + ": " + filled.error().message);
    for (std::size_t v = 0; v < map.values.size(); ++v) {
      if (filled->mask.values[v] > 0.0F) map.values[v] = static_cast<float>(number + more);
    }
    notes.push_back(fmt::format("{}, from {} contours in {} planes {:.2f} mm apart", name,
                                one->contours.size(), filled->planes, filled->spacing_mm));
    for (const std::string& note : filled->notes) notes.push_back(note);
    if (!one->series.empty() && !mri.series.empty() &&
        std::find(one->series.begin(), one->series.end(), mri.series) == one->series.end()) {
      notes.emplace_back("drawn on another series in the MRI's frame of reference");
    }
  }
  return map;
}

Result<GivenTumour> from_structures(const TumourFile& given, const VoxelImage& grid,
                                    const MriIdentity& mri) {
  const auto set = io::read_dicom_structures(given.file);
  if (!set) return tl::unexpected(set.error());
  io::LabelNames names;
  for (const io::DicomStructure& one : set->structures) names[one.number] = one.name;
  const auto choice =
      only_or_named(given, names, "structure", [&] { return listed_structures(*set, grid, mri); });
  if (!choice) return tl::unexpected(choice.error());
  GivenTumour tumour{{}, choice->labels, choice->why, {}, true};
  // 0 is the background of a map.
  const int more = names.empty() ? 0 : std::max(0, 1 - names.begin()->first);
  auto map = structure_map(*set, choice->labels, more, grid, mri, tumour.notes);
  if (!map) return io::file_error(given.file, map.error());
  for (int& label : tumour.labels) label += more;
  if (more > 0) {
    tumour.notes.push_back(fmt::format("labels are the structures' numbers and {}", more));
  }
  tumour.labels = left_in(*map, tumour.labels);
  tumour.map = std::move(*map);
  return tumour;
}

Result<GivenTumour> from_segments(const TumourFile& given, const MriIdentity& mri) {
  const auto seg = io::read_dicom_segmentation(given.file);
  if (!seg) return tl::unexpected(seg.error());
  if (Status same = same_frame("FrameOfReferenceUID (0020,0052)", seg->frame_of_reference, mri);
      !same) {
    return io::file_error(given.file, same.error());
  }
  if (!seg->names.empty() && seg->names.begin()->first < 1) {
    return invalid(given.file.string() +
                   ": a segment has no number (0062,0004) from 1 on, as DICOM numbers them");
  }
  const auto choice =
      only_or_named(given, seg->names, "segment", [&] { return listed_segments(seg->names); });
  if (!choice) return tl::unexpected(choice.error());
  VoxelImage map = io::label_map(*seg, choice->labels);
  std::vector<int> labels = left_in(map, choice->labels);
  return GivenTumour{std::move(map), std::move(labels), choice->why, {}, true};
}

}  // namespace

Result<GivenTumour> read_tumour(const TumourFile& given, const VoxelImage& grid,
                                const MriIdentity& mri) {
  const bool dicom = io::is_dicom(given.file);
  if (dicom && !given.segment.empty()) {
    return invalid(
        fmt::format("--tumour-segment: {}: is for a .seg.nrrd; {} is DICOM, whose segments and "
                    "structures --tumour-label names",
                    in_quotes(given.segment), given.file.string()));
  }
  if (!given.label.empty() && !given.segment.empty()) {
    return invalid(fmt::format("--tumour-label {} and --tumour-segment {}: give one of them",
                               in_quotes(given.label), in_quotes(given.segment)));
  }
  if (dicom) {
    return io::is_dicom_structures(given.file) ? from_structures(given, grid, mri)
                                               : from_segments(given, mri);
  }
  auto map = io::read_label_map(given.file, {given.segment, 1});
  if (!map && given.segment.empty() && map.error().code == ErrorCode::kInvalidArgument) {
    return invalid(map.error().message + " (--tumour-segment)");
  }
  if (!map) return tl::unexpected(map.error());
  for (const float v : map->values) {
    if (std::isfinite(v) && std::abs(v) >= anatomy::kLargestLabel) {
      return invalid(
          fmt::format("{}: is no label map: it has the value {:g}", given.file.string(), v));
    }
  }
  const auto choice = tumour_labels(given, *map);
  if (!choice) return tl::unexpected(choice.error());
  if (std::find(choice->labels.begin(), choice->labels.end(), 0) != choice->labels.end()) {
    return invalid("--tumour-label: 0: is the background of " + given.file.string());
  }
  return GivenTumour{std::move(*map),
                     choice->labels,
                     given.segment.empty() ? choice->why : "the segment",
                     {},
                     false};
}

namespace {

constexpr Eigen::Index kMostPlaces = 4000;
constexpr double kMostOutside = 0.5;

// Of places of the tumour: the share that lies in no voxel of the mask, and how far the farthest
// of these lies from one.
class BrainPlaces {
 public:
  explicit BrainPlaces(const VoxelImage& mask)
      : mask_(mask), T_voxel_ras_(mask.T_ras_voxel.inverse()) {}

  bool has(const Vec3& x) const { return geometry::mask_has(mask_, T_voxel_ras_, x); }
  double outside_share(const Points& places) const {
    double outside = 0.0;
    for (const auto& x : places.colwise()) outside += has(x) ? 0.0 : 1.0;
    return outside / static_cast<double>(std::max<Eigen::Index>(1, places.cols()));
  }
  double farthest_mm(const Points& places) const {
    VecX nearest = VecX::Constant(places.cols(), std::numeric_limits<double>::infinity());
    std::vector<Eigen::Index> outside;
    for (Eigen::Index i = 0; i < places.cols(); ++i) {
      if (!has(places.col(i))) outside.push_back(i);
    }
    const std::size_t step = 1 + outside.size() / 100;
    geometry::for_each_voxel(
        mask_, [](float v) { return v > 0.0F; },
        [&](std::size_t, const Vec3& voxel) {
          for (std::size_t i = 0; i < outside.size(); i += step) {
            double& least = nearest[outside[i]];
            least = std::min(least, (places.col(outside[i]) - voxel).squaredNorm());
          }
        });
    double farthest = 0.0;
    for (const double squared : nearest) {
      if (std::isfinite(squared)) farthest = std::max(farthest, squared);
    }
    return std::sqrt(farthest);
  }

 private:
  const VoxelImage& mask_;
  AffineTransform T_voxel_ras_;
};

}  // namespace

Result<std::string> place_in_brain(const Points& voxels, const VoxelImage& brain,
                                   const std::string& what) {
  // A label map may leave the tumour out of the brain.
  const VoxelImage filled = geometry::largest_component(brain).value_or(brain);
  const BrainPlaces in_brain(filled);
  const Eigen::Index step = 1 + voxels.cols() / kMostPlaces;
  Points places(3, (voxels.cols() + step - 1) / step);
  for (Eigen::Index i = 0; i < places.cols(); ++i) places.col(i) = voxels.col(step * i);
  const double share = in_brain.outside_share(places), far = in_brain.farthest_mm(places);
  if (share == 0.0) return std::string();
  const std::string sentence =
      fmt::format("{}: {:.0f} % of the tumour lie outside the brain, up to {:.0f} mm from it", what,
                  std::max(1.0, 100.0 * share), far);
  if (share > kMostOutside) {
    return invalid(sentence + geometry::likely_mistake(places, [&](const Points& meant) {
                     return in_brain.outside_share(meant) <= kMostOutside;
                   }));
  }
  return far > anatomy::kLargestCut_mm
             ? sentence +
                   fmt::format("; more than {:g} mm are not prepared", anatomy::kLargestCut_mm)
             : std::string();
}

}  // namespace brainshift::client
