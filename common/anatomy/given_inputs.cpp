// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/given_inputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "common/geometry/mask.hpp"
#include "common/geometry/surface.hpp"
#include "common/geometry/surface_check.hpp"

namespace brainshift::anatomy {
namespace {

constexpr double kCrack_mm = 1e-3;
constexpr double kMm3PerCc = 1000.0;
// Rounding of a scaled label.
constexpr float kWholeNumber = 1e-3F;
// A label map has fewer different values, an interpolated mask more.
constexpr std::size_t kFewValues = 16;
constexpr double kTop = 0.9, kLeastTop = 1.0 / 3.0;
constexpr double kBackground = 0.05;  // what a network leaves outside of a mask
constexpr double kLargestRipple = 0.05;
constexpr double kLargestLostPart = 0.1;
constexpr double kLittle = 0.1;
constexpr const char* kNothingToDo = "nothing to do";
// A shorter tumour has no surface, and none is longer than a head or has half of a brain's volume.
constexpr double kLeastTumour_mm = 0.5, kLongestTumour_mm = 250.0, kLargestTumour_cc = 900.0;
constexpr double kLargestImage_cc = 64000.0;  // a cube of 400 mm
constexpr std::size_t kManyLabels = 60;
constexpr double kLeastAlike = 0.25;

bool is_whole(float v) { return std::abs(v - std::round(v)) <= kWholeNumber; }

double voxel_mm3(const VoxelImage& image) {
  return std::abs(image.T_ras_voxel.linear().determinant());
}

struct MaskValues {
  std::size_t positive = 0, negative = 0;
  // From kTop, and from kBackground of the largest value on.
  std::size_t top = 0, foreground = 0;
  float least = 0.0F, most = 0.0F;
  bool one_negative = true, whole = true;
  std::set<float> different;  // of those > 0, up to kFewValues + 1
};

MaskValues values_of(const VoxelImage& image) {
  MaskValues values;
  for (const float v : image.values) {
    if (!std::isfinite(v)) continue;
    values.whole = values.whole && is_whole(v);
    if (v < 0.0F) {
      values.one_negative = values.one_negative && (values.negative == 0 || v == values.least);
      ++values.negative;
      values.least = std::min(values.least, v);
    } else if (v > 0.0F) {
      ++values.positive;
      values.most = std::max(values.most, v);
      if (values.different.size() <= kFewValues) values.different.insert(v);
    }
  }
  for (const float v : image.values) {
    if (!(v > 0.0F)) continue;
    values.top += v >= kTop * values.most ? 1 : 0;
    values.foreground += v >= kBackground * values.most ? 1 : 0;
  }
  return values;
}

// A plateau, and values on the way down from it.
bool is_soft(const MaskValues& values) {
  const bool between =
      values.different.size() > 1 && (!values.whole || values.different.size() > kFewValues);
  return between &&
         static_cast<double>(values.top) >= kLeastTop * static_cast<double>(values.foreground);
}

// The greatest value of a soft mask's plateau, which a spline overshoots.
float plateau_of(const MaskValues& values) {
  return values.most > 0.8F && values.most < 1.3F ? 1.0F : values.most;
}

VoxelImage from_level(const VoxelImage& image, float level) {
  VoxelImage mask = image;
  for (float& v : mask.values) v = v >= level ? 1.0F : 0.0F;
  return mask;
}

// Heads of label maps without the fluid outside of the brain: 15 to 17 %; masks that bridge the
// sulci: 1 to 2.4 % (docs/decisions/0043-sulci-are-filled.md).
constexpr double kGap_mm = 3.0, kSulciShare = 0.06;

std::string place_text(const Vec3& x) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f})", x[0], x[1], x[2]);
}

}  // namespace

void add_note(Notes* notes, const std::string& note) {
  if (notes != nullptr) notes->push_back(note);
}

std::string what_to_do(double share, const char* place) {
  if (share <= kLittle) return std::string("; ") + kNothingToDo;
  return fmt::format("; look at the {} in the pictures, and at the labels there", place);
}

bool asks_nothing(const std::string& note) { return note.ends_with(kNothingToDo); }

Status check_extent(const Vec3& size_mm, const std::string& what, double least_mm, double most_mm) {
  const double extent = size_mm.maxCoeff();
  const auto fits = [&](double factor) {
    return factor * extent >= least_mm && factor * extent <= most_mm;
  };
  if (fits(1.0)) return {};
  // The usual mistake is a factor of 1000 either way.
  const char* hint = fits(1000.0)  ? "; metres instead of millimetres?"
                     : fits(0.001) ? "; micrometres instead of millimetres?"
                                   : "";
  return invalid(fmt::format("{} extent {:.4g} mm must be between {} and {} mm{}", what, extent,
                             least_mm, most_mm, hint));
}

Result<VoxelImage> brain_mask(const VoxelImage& image, const std::string& what, Notes* notes) {
  const MaskValues values = values_of(image);
  float level = std::numeric_limits<float>::denorm_min();
  const bool ripples = -values.least <= kLargestRipple * values.most;
  if (is_soft(values) && (values.negative == 0 || -values.least < 0.25F * values.most)) {
    level = 0.5F * plateau_of(values);
    add_note(notes, fmt::format("{}: a soft mask, with values between 0 and {:g}; voxels from {:g} "
                                "on are taken for brain",
                                what, plateau_of(values), level));
  } else if (values.negative > 0 && !values.one_negative) {
    if (!ripples) {
      return invalid(
          fmt::format("{}: {} voxels are below 0 (down to {:.3g}) and {} above: a normalised "
                      "image, and no mask; "
                      "give a mask, 1 in the brain and 0 outside",
                      what, values.negative, values.least, values.positive));
    }
    level = std::nextafter(-values.least, values.most);
    add_note(notes, fmt::format("{}: has ripples down to {:.3g}; voxels above {:.3g} are taken for "
                                "brain",
                                what, values.least, -values.least));
  }
  const VoxelImage mask = from_level(image, level);
  auto largest = geometry::largest_component(mask);
  if (!largest) {
    return fail(largest.error().code, fmt::format("{}: {}", what, largest.error().message));
  }
  const double cc = geometry::mask_centre(*largest).volume_mm3 / kMm3PerCc;
  // Of a mask in other units its extent tells more.
  const bool too_large = cc > kLargestBrain_cc && cc < kLargestImage_cc;
  if (too_large && values.different.size() > kFewValues) {
    return invalid(fmt::format(
        "{}: is an image of the whole head, not a brain: {:.0f} cc of it are above {:.3g}, with "
        "more than {} different values; give a mask, or the image without skull and face",
        what, cc, std::max(0.0F, level), kFewValues));
  }
  if (too_large) {
    return invalid(
        fmt::format("{}: {:.0f} cc are no brain (at most {:.0f} cc): is it turned inside "
                    "out, or the whole head? 1 in the brain and 0 outside",
                    what, cc, kLargestBrain_cc));
  }
  const geometry::MaskParts parts = geometry::mask_parts(mask);
  if (parts.voxels.size() < 2) return largest;
  std::size_t lost = 0;
  for (std::size_t i = 1; i < parts.voxels.size(); ++i) lost += parts.voxels[i];
  const double to_cc = voxel_mm3(image) / kMm3PerCc;
  const double first = static_cast<double>(parts.voxels[0]) * to_cc,
               second = static_cast<double>(parts.voxels[1]) * to_cc;
  if (second > kLargestLostPart * (first + static_cast<double>(lost) * to_cc)) {
    return invalid(fmt::format(
        "{}: falls into {} parts that do not touch, of {:.1f} and {:.1f} cc and so on: must be one",
        what, parts.voxels.size(), first, second));
  }
  add_note(notes,
           fmt::format("{}: parts beside the brain of {:.1f} cc are left out: {}, {:.2f} cc in all",
                       what, first, parts.voxels.size() - 1, static_cast<double>(lost) * to_cc));
  return largest;
}

VoxelImage without_sulci(VoxelImage mask, const std::string& what, Notes* notes) {
  const auto voxels = [](const VoxelImage& image) {
    return std::accumulate(image.values.begin(), image.values.end(), 0.0);
  };
  const VoxelImage closed = geometry::close_gaps(mask, kGap_mm);
  const double share = voxels(closed) / voxels(mask) - 1.0;
  if (share <= kSulciShare) return mask;
  auto filled = geometry::largest_component(closed);  // pockets that are closed off now
  if (!filled) return mask;
  add_note(notes, fmt::format("{}: follows the sulci; gaps of less than {:g} mm are filled, which "
                              "adds {:.0f} % to the brain's volume",
                              what, 2.0 * kGap_mm, 100.0 * (voxels(*filled) / voxels(mask) - 1.0)));
  return std::move(*filled);
}

Status check_label_map(const VoxelImage& map, const std::string& what) {
  std::set<float> different;
  std::optional<float> odd;
  std::size_t labelled = 0, as_next = 0;
  for (std::size_t v = 0; v + 1 < map.values.size(); ++v) {
    const float value = map.values[v];
    if (!(value > 0.0F)) continue;
    ++labelled;
    as_next += value == map.values[v + 1] ? 1 : 0;
    if (different.size() <= kManyLabels) different.insert(value);
  }
  for (const float v : map.values) {
    if (odd || !std::isfinite(v) || (is_whole(v) && std::abs(v) < kLargestLabel)) continue;
    odd = v;
  }
  const double alike = static_cast<double>(as_next) / static_cast<double>(labelled);
  if (different.size() > kManyLabels && alike < kLeastAlike) {
    return invalid(fmt::format(
        "{}: is an image, not a label map: only {:.0f} % of its voxels have the value of the next "
        "one, with more than {} different values",
        what, 100.0 * alike, kManyLabels));
  }
  if (!odd) return {};
  return invalid(fmt::format(
      "{}: is no label map: it has the value {:g}{}", what, *odd,
      is_whole(*odd) ? "" : ", no whole number; resample the labels by nearest neighbour"));
}

std::string listed_labels(const VoxelImage& image) {
  constexpr std::size_t kMost = 20;
  std::map<long, std::size_t> counts;
  for (const float v : image.values) {
    if (std::isfinite(v) && std::round(v) != 0.0F) ++counts[std::lround(v)];
  }
  std::string list;
  std::size_t shown = 0;
  for (const auto& [label, count] : counts) {
    if (shown++ == kMost) return list + fmt::format(" and {} more", counts.size() - kMost);
    list += fmt::format("{}{} ({:.2f} cc)", list.empty() ? "" : ", ", label,
                        static_cast<double>(count) * voxel_mm3(image) / kMm3PerCc);
  }
  return list.empty() ? "none" : list;
}

namespace {

// 1 where a voxel has one of the labels.
Result<VoxelImage> label_mask(const VoxelImage& image, const std::vector<int>& labels,
                              const std::string& what, Notes* notes) {
  std::size_t odd = 0;
  float example = 0.0F;
  for (const float v : image.values) {
    if (!std::isfinite(v) || is_whole(v)) continue;
    if (odd++ == 0) example = v;
  }
  const MaskValues values = values_of(image);
  const bool probabilities = labels == std::vector<int>{1} && values.most > 0.8F &&
                             values.most < 1.3F && values.least > -0.3F;
  // Of whole numbers: a mask of 0 and 255, say, that was resampled.
  const bool soft = odd == 0 && is_soft(values) && labels.size() == 1 &&
                    labels.front() == std::lround(values.most);
  if (odd > 0 || soft) {
    if (!probabilities && !soft) {
      return invalid(fmt::format(
          "{}: {} voxels are no whole numbers (the first: {:.4g}), so they are no labels; resample "
          "the segmentation by nearest neighbour",
          what, odd, example));
    }
    const float most = soft ? values.most : 1.0F;
    add_note(notes, fmt::format("{}: a soft mask, with values between 0 and {:g}; voxels from {:g} "
                                "on are taken for the tumour",
                                what, most, 0.5F * most));
    return from_level(image, 0.5F * most);
  }
  VoxelImage mask = image;
  std::map<int, std::size_t> counts;
  for (float& v : mask.values) {
    const auto found =
        std::isfinite(v) ? std::find(labels.begin(), labels.end(), std::lround(v)) : labels.end();
    if (found != labels.end()) ++counts[*found];
    v = found != labels.end() ? 1.0F : 0.0F;
  }
  std::string volumes;
  for (const int label : labels) {
    if (counts.count(label) == 0) {
      return fail(ErrorCode::kEmptySet,
                  fmt::format("{}: label = {}: no voxel has this label; there are: {}", what, label,
                              listed_labels(image)));
    }
    volumes += fmt::format("{}label {} {:.2f} cc", volumes.empty() ? "" : ", ", label,
                           static_cast<double>(counts[label]) * voxel_mm3(image) / kMm3PerCc);
  }
  if (labels.size() > 1) add_note(notes, fmt::format("{}: {}", what, volumes));
  return mask;
}

// Voxels of a part, with a margin.
Focus cut_out(const VoxelImage& image, const geometry::MaskParts& parts, std::int32_t part,
              double margin_mm) {
  std::array<int, 3> low = image.dims, high = {-1, -1, -1};
  Vec3 sum = Vec3::Zero();
  std::size_t v = 0;
  for (int k = 0; k < image.dims[2]; ++k) {
    for (int j = 0; j < image.dims[1]; ++j) {
      for (int i = 0; i < image.dims[0]; ++i, ++v) {
        if (parts.part_of_voxel[v] != part) continue;
        const std::array<int, 3> at = {i, j, k};
        for (std::size_t a = 0; a < 3; ++a) {
          low[a] = std::min(low[a], at[a]), high[a] = std::max(high[a], at[a]);
        }
        sum += Vec3(i, j, k);
      }
    }
  }
  const std::size_t count = parts.voxels[static_cast<std::size_t>(part)];
  Focus focus;
  focus.volume_mm3 = static_cast<double>(count) * voxel_mm3(image);
  focus.centre = image.T_ras_voxel * Vec3(sum / static_cast<double>(count));
  // Beyond the image as well: a tumour may touch its border.
  for (std::size_t a = 0; a < 3; ++a) {
    const double step = image.T_ras_voxel.linear().col(static_cast<Eigen::Index>(a)).norm();
    const int margin = static_cast<int>(std::ceil(margin_mm / step));
    low[a] -= margin;
    focus.mask.dims[a] = high[a] + margin + 1 - low[a];
  }
  focus.mask.T_ras_voxel = image.T_ras_voxel;
  focus.mask.T_ras_voxel.translation() = image.T_ras_voxel * Vec3(low[0], low[1], low[2]);
  focus.mask.values.assign(focus.mask.num_voxels(), 0.0F);
  v = 0;
  for (int k = 0; k < focus.mask.dims[2]; ++k) {
    for (int j = 0; j < focus.mask.dims[1]; ++j) {
      for (int i = 0; i < focus.mask.dims[0]; ++i, ++v) {
        const int at[] = {i + low[0], j + low[1], k + low[2]};
        bool inside = true;
        for (int a = 0; a < 3; ++a) {
          inside = inside && at[a] >= 0 && at[a] < image.dims[static_cast<std::size_t>(a)];
        }
        if (!inside) continue;
        const std::size_t from =
            static_cast<std::size_t>(at[0]) +
            static_cast<std::size_t>(image.dims[0]) *
                (static_cast<std::size_t>(at[1]) +
                 static_cast<std::size_t>(image.dims[1]) * static_cast<std::size_t>(at[2]));
        focus.mask.values[v] = parts.part_of_voxel[from] == part ? 1.0F : 0.0F;
      }
    }
  }
  return focus;
}

// Lengths in other units, and the background.
Status check_size(const VoxelImage& mask, const std::string& what) {
  const geometry::MaskCentre found = geometry::mask_centre(mask);
  if (found.volume_mm3 == 0.0) return {};
  const double edge = mask.T_ras_voxel.linear().colwise().norm().minCoeff();
  const Vec3 size = (found.high - found.low).array() + edge;
  if (Status fits = check_extent(size, what + ": the tumour's", kLeastTumour_mm, kLongestTumour_mm);
      !fits) {
    return fits;
  }
  const double cc = found.volume_mm3 / kMm3PerCc;
  if (cc <= kLargestTumour_cc) return {};
  return invalid(
      fmt::format("{}: {:.0f} cc are no tumour (at most {:.0f} cc): is it the "
                  "background, or the brain?",
                  what, cc, kLargestTumour_cc));
}

}  // namespace

Result<std::vector<Focus>> tumour_foci(const VoxelImage& image, const std::vector<int>& labels,
                                       double margin_mm, const std::string& what, Notes* notes) {
  const auto mask = label_mask(image, labels, what, notes);
  if (!mask) return tl::unexpected(mask.error());
  if (Status sized = check_size(*mask, what); !sized) return tl::unexpected(sized.error());
  const geometry::MaskParts parts = geometry::mask_parts(*mask);
  std::vector<Focus> foci;
  std::size_t specks = 0;
  double speck_mm3 = 0.0;
  std::string told;
  for (std::size_t part = 0; part < parts.voxels.size(); ++part) {
    const double volume = static_cast<double>(parts.voxels[part]) * voxel_mm3(image);
    if (part > 0 && volume < kSmallestFocus_mm3) {
      ++specks, speck_mm3 += volume;
      continue;
    }
    foci.push_back(cut_out(*mask, parts, static_cast<std::int32_t>(part), margin_mm));
    told += fmt::format("{}{:.2f} cc at {}", told.empty() ? "" : ", ",
                        foci.back().volume_mm3 / kMm3PerCc, place_text(foci.back().centre));
  }
  if (foci.empty()) {
    return fail(ErrorCode::kEmptySet, fmt::format("{}: no voxel is > 0", what));
  }
  if (foci.size() > 1) {
    add_note(notes, fmt::format("{}: the tumour has {} parts: {}", what, foci.size(), told));
  }
  if (specks > 0) {
    double all_mm3 = speck_mm3;
    for (const Focus& focus : foci) all_mm3 += focus.volume_mm3;
    add_note(notes, fmt::format("{}: specks below {:g} cc are left out: {}, {:.3f} cc in all{}",
                                what, kSmallestFocus_mm3 / kMm3PerCc, specks, speck_mm3 / kMm3PerCc,
                                what_to_do(speck_mm3 / all_mm3, "tumour")));
  }
  return foci;
}

Status check_surface(const TriangleSurface& surface, const std::string& what) {
  if (surface.num_triangles() == 0) return fail(ErrorCode::kEmptySet, what + ": has no triangle");
  if (!surface.vertices.allFinite()) {
    return fail(ErrorCode::kNotFinite, what + ": has a vertex that is not finite");
  }
  if (surface.triangles.minCoeff() >= 0 && surface.triangles.maxCoeff() < surface.num_vertices()) {
    return {};
  }
  return invalid(what + ": a triangle names a vertex that does not exist");
}

Result<TriangleSurface> closed_surface(const TriangleSurface& surface, const std::string& what,
                                       Notes* notes) {
  if (Status whole = check_surface(surface, what); !whole) return tl::unexpected(whole.error());
  const auto refuse = [&what](const std::string& reason) {
    return invalid(fmt::format("{}: must be a closed surface: {}", what, reason));
  };
  TriangleSurface closed = surface;
  if (!geometry::is_closed(surface)) {
    auto mended = geometry::mend_surface(surface, kCrack_mm);
    const auto rims = geometry::surface_rims(mended.surface);
    if (!rims) {
      return refuse(rims.error().message);
    }
    if (!rims->rim_mm.empty()) {
      return refuse(fmt::format("it has {} open edges round {} holes, the longest rim {:.3g} mm",
                                rims->open_edges, rims->rim_mm.size(),
                                *std::max_element(rims->rim_mm.begin(), rims->rim_mm.end())));
    }
    add_note(notes,
             fmt::format("{}: was closed: {} vertices within {:g} mm of another were merged, "
                         "{} triangles that it has twice were dropped",
                         what, mended.merged_vertices, kCrack_mm, mended.repeated_triangles));
    closed = std::move(mended.surface);
  }
  if (geometry::enclosed_volume(closed) < 0.0)
    closed.triangles.row(1).swap(closed.triangles.row(2));
  return closed;
}

}  // namespace brainshift::anatomy
