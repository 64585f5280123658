// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/regions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <set>
#include <utility>

#include "common/configuration/case_keys.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/mask.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::anatomy {

struct Regions::Labels {
  std::array<int, 3> dims{};
  AffineTransform T_ras_voxel, T_voxel_ras;
  std::vector<std::int32_t> values;
};

namespace {

constexpr double kMargin_mm = 8.0;  // about the labels: what the mask has more than they
constexpr double kCell_mm = 2.0;    // of the smoothed values, where voxels are smaller

int whole(float v) { return std::isfinite(v) ? static_cast<int>(std::lround(v)) : 0; }

int region_of(int label, const AnatomyConfig& wanted, bool matter) {
  switch (structure_of(label)) {
    case Structure::kCerebrum: {
      const Side side = side_of(label);
      if (side == Side::kNone) return 0;
      const bool white = matter && matter_of(label) == Matter::kWhite;
      if (!wanted.septa && !white) return kLeftGrey;
      if (!wanted.septa) return kLeftWhite;
      return side == Side::kLeft ? (white ? kLeftWhite : kLeftGrey)
                                 : (white ? kRightWhite : kRightGrey);
    }
    case Structure::kCerebellum:
      return wanted.septa || wanted.tissues ? kCerebellumRegion : kLeftGrey;
    case Structure::kBrainstem:
      return wanted.tissues || wanted.septa ? kBrainstemRegion : kLeftGrey;
    case Structure::kVentricle: return wanted.ventricles ? kVentricleRegion : 0;
    default: return 0;
  }
}

// The part of a map round its labels of the brain.
VoxelImage cut_to_labels(const VoxelImage& map) {
  std::array<int, 3> low = map.dims, high = {-1, -1, -1};
  std::size_t v = 0;
  for (int k = 0; k < map.dims[2]; ++k)
    for (int j = 0; j < map.dims[1]; ++j)
      for (int i = 0; i < map.dims[0]; ++i, ++v) {
        if (structure_of(whole(map.values[v])) == Structure::kOther) continue;
        const std::array<int, 3> at = {i, j, k};
        for (std::size_t a = 0; a < 3; ++a) {
          low[a] = std::min(low[a], at[a]);
          high[a] = std::max(high[a], at[a]);
        }
      }
  VoxelImage cut;
  cut.T_ras_voxel = map.T_ras_voxel;
  for (std::size_t a = 0; a < 3; ++a) {
    const double step = map.T_ras_voxel.linear().col(static_cast<Eigen::Index>(a)).norm();
    const int margin = static_cast<int>(std::ceil(kMargin_mm / step));
    low[a] -= margin;
    cut.dims[a] = high[a] + margin - low[a] + 1;
  }
  cut.T_ras_voxel.translation() = map.T_ras_voxel * Vec3(low[0], low[1], low[2]);
  cut.values.assign(cut.num_voxels(), 0.0F);
  for (int k = 0; k < cut.dims[2]; ++k)
    for (int j = 0; j < cut.dims[1]; ++j)
      for (int i = 0; i < cut.dims[0]; ++i) {
        const int x = i + low[0], y = j + low[1], z = k + low[2];
        const bool inside =
            x >= 0 && y >= 0 && z >= 0 && x < map.dims[0] && y < map.dims[1] && z < map.dims[2];
        if (inside) cut.values[grid_index(cut.dims, i, j, k)] = map.at(x, y, z);
      }
  return cut;
}

// Every voxel without a region takes that of the nearest one (by steps along the axes) that has one
// and is no ventricle.
void fill(std::vector<std::uint8_t>& regions, const std::array<int, 3>& dims) {
  std::vector<std::size_t> front;
  for (std::size_t v = 0; v < regions.size(); ++v) {
    if (regions[v] != 0 && regions[v] != kVentricleRegion) front.push_back(v);
  }
  const std::array<std::size_t, 3> stride = {
      1, static_cast<std::size_t>(dims[0]),
      static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1])};
  std::vector<std::size_t> next;
  while (!front.empty()) {
    next.clear();
    for (const std::size_t v : front) {
      for (std::size_t a = 0; a < 3; ++a) {
        const std::size_t at = v / stride[a] % static_cast<std::size_t>(dims[a]);
        const auto reach = [&](std::size_t neighbour) {
          if (regions[neighbour] != 0) return;
          regions[neighbour] = regions[v];
          next.push_back(neighbour);
        };
        if (at > 0) reach(v - stride[a]);
        if (at + 1 < static_cast<std::size_t>(dims[a])) reach(v + stride[a]);
      }
    }
    front.swap(next);
  }
}

// Labels of the left must lie left of those of the right: x grows to the patient's right.
Status check_sides(const VoxelImage& map, const std::string& what) {
  double sum[2] = {}, count[2] = {};
  const auto has_side = [](float v) {
    return structure_of(whole(v)) == Structure::kCerebrum && side_of(whole(v)) != Side::kNone;
  };
  geometry::for_each_voxel(map, has_side, [&](std::size_t v, const Vec3& x) {
    const std::size_t side = side_of(whole(map.values[v])) == Side::kLeft ? 0 : 1;
    sum[side] += x.x();
    count[side] += 1.0;
  });
  if (count[0] == 0.0 || count[1] == 0.0 || sum[0] / count[0] < sum[1] / count[1]) return {};
  return invalid(fmt::format(
      "{}: labels of the left hemisphere lie right of those of the right one (middles at R {:.0f} "
      "and {:.0f} mm): the map is mirrored, or its numbers are",
      what, sum[0] / count[0], sum[1] / count[1]));
}

// Whether a point of the head lies in a voxel > 0.
auto inside_mask(const VoxelImage& brain) {
  return [&brain, T_voxel_ras = AffineTransform(brain.T_ras_voxel.inverse())](const Vec3& x) {
    const Vec3 place = T_voxel_ras * x;
    std::array<int, 3> at{};
    for (std::size_t a = 0; a < 3; ++a) {
      at[a] = static_cast<int>(std::lround(place[static_cast<Eigen::Index>(a)]));
      if (at[a] < 0 || at[a] >= brain.dims[a]) return false;
    }
    return brain.at(at[0], at[1], at[2]) > 0.0F;
  };
}

// brain: the head's mask; may be empty.
Status check_map(const VoxelImage& map, const AnatomyConfig& wanted, const VoxelImage& brain,
                 const std::string& what, Notes* notes) {
  std::set<int> labels;
  for (const float v : map.values) labels.insert(whole(v));
  const auto has = [&](auto&& is) { return std::any_of(labels.begin(), labels.end(), is); };
  const auto structure = [](Structure one) {
    return [one](int label) { return structure_of(label) == one; };
  };
  if (!has(structure(Structure::kCerebrum))) {
    return invalid(
        fmt::format("{}: no label is of the cerebrum by anatomy.numbers = {} (there: {})", what,
                    word_of(wanted.numbers, kNumbersWords), listed_labels(map)));
  }
  const auto cortex_of = [](Side side) {
    return [side](int label) {
      return structure_of(label) == Structure::kCerebrum && side_of(label) == side &&
             matter_of(label) == Matter::kCortex;
    };
  };
  if (wanted.septa && !(has(cortex_of(Side::kLeft)) && has(cortex_of(Side::kRight)))) {
    return invalid(
        fmt::format("{}: does not tell the cortex of the left hemisphere from that of the right, "
                    "which falx and tentorium need (anatomy.septa: off leaves them out)",
                    what));
  }
  if (Status sides = check_sides(map, what); !sides) return sides;
  std::set<int> strange;
  std::copy_if(labels.begin(), labels.end(), std::inserter(strange, strange.end()),
               [&](int label) { return label != 0 && structure_of(label) == Structure::kOther; });
  if (!strange.empty()) {
    // Skull and scalp are no part of the brain, and not missed.
    VoxelImage others = map;
    others.values.assign(map.values.size(), 0.0F);
    geometry::for_each_voxel(
        map, [&](float v) { return strange.count(whole(v)) != 0; },
        [&, in_mask = inside_mask(brain)](std::size_t v, const Vec3& x) {
          if (brain.values.empty() || in_mask(x)) others.values[v] = map.values[v];
        });
    if (const std::string list = listed_labels(others); list != "none") {
      const double share = brain.values.empty() ? 0.0
                                                : geometry::mask_centre(others).volume_mm3 /
                                                      geometry::mask_centre(brain).volume_mm3;
      add_note(notes, fmt::format("{}: not of the brain by anatomy.numbers = {}: {}; where the "
                                  "brain is, the nearest part takes their place{}",
                                  what, word_of(wanted.numbers, kNumbersWords), list,
                                  what_to_do(share, "brain")));
    }
  }
  const std::pair<bool, std::pair<Structure, const char*>> absent[] = {
      {wanted.septa || wanted.tissues, {Structure::kCerebellum, "cerebellum"}},
      {wanted.tissues, {Structure::kBrainstem, "brainstem"}},
      {wanted.ventricles, {Structure::kVentricle, "ventricles"}}};
  for (const auto& [asked, part] : absent) {
    if (asked && !has(structure(part.first))) {
      add_note(notes,
               fmt::format("{}: has no label of the {}; the model knows none", what, part.second));
    }
  }
  return {};
}

bool is_brain(float value) {
  const Structure structure = structure_of(whole(value));
  return structure != Structure::kOther && structure != Structure::kFluid;
}

// The 10 mm cells of a head that hold one of some points, and all within two cells of them.
class Neighbourhood {
 public:
  void add(const Vec3& x) { cells_.insert(cell_of(x)); }
  void grow() {
    constexpr int kReach = 2;
    std::set<Cell> grown;
    for (const Cell& at : cells_)
      for (int k = -kReach; k <= kReach; ++k)
        for (int j = -kReach; j <= kReach; ++j)
          for (int i = -kReach; i <= kReach; ++i) grown.insert({at[0] + i, at[1] + j, at[2] + k});
    cells_.swap(grown);
  }
  bool has(const Vec3& x) const { return cells_.count(cell_of(x)) != 0; }

 private:
  using Cell = std::array<int, 3>;
  static Cell cell_of(const Vec3& x) {
    const auto of = [&x](int a) { return static_cast<int>(std::floor(x[a] / 10.0)); };
    return {of(0), of(1), of(2)};
  }
  std::set<Cell> cells_;
};

// A map of another head, or of this one elsewhere, puts septa and ventricles where none are.
Status check_fit(const VoxelImage& map, const VoxelImage& brain, const std::string& mask,
                 const std::string& what) {
  if (brain.values.empty()) return {};
  const auto in_mask = inside_mask(brain);
  Neighbourhood labelled;
  double labels = 0.0, outside = 0.0;
  geometry::for_each_voxel(map, is_brain, [&](std::size_t, const Vec3& x) {
    labels += 1.0;
    labelled.add(x);
    bool near = in_mask(x);
    for (int d = 0; !near && d < 27; ++d) {
      const Vec3 way(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1);
      near = d != 13 && in_mask(x + Regions::kSlack_mm * way.normalized());
    }
    outside += near ? 0.0 : 1.0;
  });
  if (outside > Regions::kFarLabels * labels) {
    return invalid(fmt::format(
        "{}: {:.0f} % of its brain lie more than {:g} mm outside the mask of {}: must be at most "
        "{:.0f} %; is it of the same head, and in the same space?",
        what, 100.0 * outside / labels, Regions::kSlack_mm, mask, 100.0 * Regions::kFarLabels));
  }
  labelled.grow();
  double voxels = 0.0, far = 0.0;
  geometry::for_each_voxel(
      brain, [](float v) { return v > 0.0F; },
      [&](std::size_t, const Vec3& x) {
        voxels += 1.0;
        far += labelled.has(x) ? 0.0 : 1.0;
      });
  if (far > Regions::kFarBrain * voxels) {
    return invalid(
        fmt::format("{}: {:.0f} % of the mask of {} lie more than 20 mm from any label "
                    "of the brain: must be at most {:.0f} %; is a part missing?",
                    what, 100.0 * far / voxels, mask, 100.0 * Regions::kFarBrain));
  }
  return {};
}

// Takes a ventricle's label from voxels inside the tumour. `map`: the one of `regions`.
Status keep_tumour(std::vector<std::uint8_t>& regions, const VoxelImage& map,
                   const TriangleSurface& tumour, Notes* notes) {
  if (std::find(regions.begin(), regions.end(), kVentricleRegion) == regions.end()) return {};
  if (!geometry::is_closed(tumour)) return {};
  const auto index = geometry::ClosestPointIndex::build(tumour);
  if (!index) return tl::unexpected(index.error());
  const Vec3 low = tumour.vertices.rowwise().minCoeff();
  const Vec3 high = tumour.vertices.rowwise().maxCoeff();
  std::size_t taken = 0;
  geometry::for_each_voxel(map, is_brain, [&](std::size_t v, const Vec3& x) {
    if (regions[v] != kVentricleRegion) return;
    if ((x.array() < low.array()).any() || (x.array() > high.array()).any()) return;
    if (!index->contains(x)) return;
    regions[v] = 0;
    ++taken;
  });
  const double mm3 = static_cast<double>(taken) * std::abs(map.T_ras_voxel.linear().determinant());
  if (mm3 >= 10.0) {
    add_note(notes, fmt::format("anatomy.labels: {:.2f} cc of the tumour lie in ventricles; they "
                                "are tissue{}",
                                mm3 / 1e3, what_to_do(0.0, "tumour")));
  }
  return {};
}

}  // namespace

Result<Regions> Regions::build(const CaseInputs& inputs, const TriangleSurface& tumour,
                               double smoothing_mm, const std::string& what, Notes* notes) {
  const VoxelImage& labels = *inputs.labels;
  // Before numbers are changed, which rounds them.
  if (Status good = check_label_map(labels, what); !good) return tl::unexpected(good.error());
  if (inputs.config.anatomy.numbers == LabelNumbers::kAal) {
    return build_from(inputs, with_freesurfer_numbers_of_aal(labels), tumour, smoothing_mm, what,
                      notes);
  }
  if (inputs.label_names.empty()) {
    return build_from(inputs, labels, tumour, smoothing_mm, what, notes);
  }
  const auto renamed = with_freesurfer_numbers(labels, inputs.label_names);
  if (!renamed) return fail(renamed.error().code, what + ": " + renamed.error().message);
  return build_from(inputs, *renamed, tumour, smoothing_mm, what, notes);
}

Result<Regions> Regions::build_from(const CaseInputs& inputs, const VoxelImage& map,
                                    const TriangleSurface& tumour, double smoothing_mm,
                                    const std::string& what, Notes* notes) {
  const AnatomyConfig& wanted = inputs.config.anatomy;
  // What the mesher makes of the mask, which also tells what is wrong with it.
  const std::string mask = fmt::format("images.brain = '{}'", inputs.config.brain.string());
  const VoxelImage brain =
      inputs.brain ? brain_mask(*inputs.brain, mask, nullptr).value_or(VoxelImage{}) : VoxelImage{};
  if (Status good = check_map(map, wanted, brain, what, notes); !good) {
    return tl::unexpected(good.error());
  }
  if (Status fits = check_fit(map, brain, mask, what); !fits) return tl::unexpected(fits.error());
  const VoxelImage cut = cut_to_labels(map);
  auto kept = std::make_shared<Labels>();
  kept->dims = cut.dims;
  kept->T_ras_voxel = cut.T_ras_voxel;
  kept->T_voxel_ras = cut.T_ras_voxel.inverse();
  Regions made;
  for (const float v : cut.values) {
    kept->values.push_back(whole(v));
    made.tells_matter_ = made.tells_matter_ || (structure_of(whole(v)) == Structure::kCerebrum &&
                                                matter_of(whole(v)) == Matter::kWhite);
  }
  made.tells_matter_ = made.tells_matter_ && wanted.tissues;
  std::map<int, std::uint8_t> known;
  std::vector<std::uint8_t> regions(kept->values.size());
  for (std::size_t v = 0; v < regions.size(); ++v) {
    const auto [entry, added] = known.try_emplace(kept->values[v], std::uint8_t{0});
    if (added) {
      entry->second =
          static_cast<std::uint8_t>(region_of(entry->first, wanted, made.tells_matter_));
    }
    regions[v] = entry->second;
  }
  if (Status kept_tissue = keep_tumour(regions, cut, tumour, notes); !kept_tissue) {
    return tl::unexpected(kept_tissue.error());
  }
  fill(regions, cut.dims);

  // Blocks of voxels of about kCell_mm, each region's share of them smoothed.
  std::array<int, 3> block{};
  AffineTransform T_ras_cell = cut.T_ras_voxel;
  Vec3 middle;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    const double step = cut.T_ras_voxel.linear().col(axis).norm();
    block[a] = std::max(1, static_cast<int>(std::lround(kCell_mm / step)));
    made.dims_[a] = (cut.dims[a] + block[a] - 1) / block[a];
    middle[axis] = 0.5 * (block[a] - 1);
    T_ras_cell.linear().col(axis) *= block[a];
  }
  T_ras_cell.translation() = cut.T_ras_voxel * middle;
  made.T_voxel_ras_ = T_ras_cell.inverse();
  const float one = 1.0F / static_cast<float>(block[0] * block[1] * block[2]);
  made.values_.resize(kRegions * grid_size(made.dims_));
  VoxelImage share{made.dims_, T_ras_cell, {}};
  for (int region = 1; region <= kRegions; ++region) {
    share.values.assign(share.num_voxels(), 0.0F);
    bool any = false;
    std::size_t v = 0;
    for (int k = 0; k < cut.dims[2]; ++k)
      for (int j = 0; j < cut.dims[1]; ++j)
        for (int i = 0; i < cut.dims[0]; ++i, ++v) {
          if (regions[v] != region) continue;
          any = true;
          share.values[grid_index(made.dims_, i / block[0], j / block[1], k / block[2])] += one;
        }
    if (!any) continue;
    const VoxelImage smooth = geometry::gaussian_smooth(share, smoothing_mm);
    for (std::size_t c = 0; c < smooth.values.size(); ++c) {
      made.values_[kRegions * c + static_cast<std::size_t>(region - 1)] = smooth.values[c];
    }
  }
  made.labels_ = std::move(kept);
  return made;
}

int Regions::at(const Vec3& x) const {
  const Vec3 place = T_voxel_ras_ * x;
  std::array<float, kRegions> sum{};
  std::array<int, 3> low{};
  Vec3 part;
  for (int a = 0; a < 3; ++a) {
    const double within =
        std::clamp(place[a], 0.0, static_cast<double>(dims_[static_cast<std::size_t>(a)] - 1));
    low[static_cast<std::size_t>(a)] =
        std::min(static_cast<int>(within), std::max(0, dims_[static_cast<std::size_t>(a)] - 2));
    part[a] = within - low[static_cast<std::size_t>(a)];
  }
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::array<int, 3> at = low;
    for (int a = 0; a < 3; ++a) {
      const bool upper = (corner >> a & 1) != 0;
      weight *= upper ? part[a] : 1.0 - part[a];
      const auto axis = static_cast<std::size_t>(a);
      if (upper) at[axis] = std::min(at[axis] + 1, dims_[axis] - 1);
    }
    const float* const values = values_.data() + kRegions * grid_index(dims_, at[0], at[1], at[2]);
    for (std::size_t r = 0; r < kRegions; ++r) sum[r] += static_cast<float>(weight) * values[r];
  }
  return 1 + static_cast<int>(std::max_element(sum.begin(), sum.end()) - sum.begin());
}

bool Regions::parted(Septum septum, const Vec3& x) const {
  const Labels& map = *labels_;
  const Vec3 middle = map.T_voxel_ras * x;
  std::array<int, 3> first{}, last{};
  for (int a = 0; a < 3; ++a) {
    const auto axis = static_cast<std::size_t>(a);
    const double reach = kReach_mm / map.T_ras_voxel.linear().col(a).norm();
    first[axis] = std::max(0, static_cast<int>(std::floor(middle[a] - reach)));
    last[axis] = std::min(map.dims[axis] - 1, static_cast<int>(std::ceil(middle[a] + reach)));
  }
  bool left = false, right = false, cerebellum = false, white_left = false, white_right = false;
  for (int k = first[2]; k <= last[2]; ++k)
    for (int j = first[1]; j <= last[1]; ++j)
      for (int i = first[0]; i <= last[0]; ++i) {
        const int label = map.values[grid_index(map.dims, i, j, k)];
        if (label == 0) continue;
        const double distance = (map.T_ras_voxel * Vec3(i, j, k) - x).norm();
        if (distance > kReach_mm) continue;
        const bool close = distance <= kClear_mm;
        switch (structure_of(label)) {
          case Structure::kCerebellum: cerebellum = true; break;
          case Structure::kBrainstem:
            if (septum == Septum::kTentorium || close) return false;
            break;
          case Structure::kVentricle:
            if (close) return false;
            break;
          case Structure::kCerebrum: {
            const Side side = side_of(label);
            if (matter_of(label) == Matter::kCortex) {
              left = left || side == Side::kLeft;
              right = right || side == Side::kRight;
            } else if (close) {
              white_left = white_left || side != Side::kRight;
              white_right = white_right || side != Side::kLeft;
            }
            break;
          }
          default: break;
        }
      }
  if (septum == Septum::kTentorium) return (left || right) && cerebellum;
  return left && right && !(white_left && white_right);
}

}  // namespace brainshift::anatomy
