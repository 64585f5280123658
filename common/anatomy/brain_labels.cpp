// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/brain_labels.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <cstdint>
#include <set>
#include <string_view>
#include <vector>

#include "common/anatomy/given_inputs.hpp"
#include "common/geometry/mask.hpp"

namespace brainshift::anatomy {
namespace {

struct NamedLabel {
  int number;
  const char* name;
  Structure structure;
};
using enum Structure;
constexpr NamedLabel kLabels[] = {{2, "Left-Cerebral-White-Matter", kCerebrum},
                                  {3, "Left-Cerebral-Cortex", kCerebrum},
                                  {4, "Left-Lateral-Ventricle", kVentricle},
                                  {5, "Left-Inf-Lat-Vent", kVentricle},
                                  {7, "Left-Cerebellum-White-Matter", kCerebellum},
                                  {8, "Left-Cerebellum-Cortex", kCerebellum},
                                  {10, "Left-Thalamus", kCerebrum},
                                  {11, "Left-Caudate", kCerebrum},
                                  {12, "Left-Putamen", kCerebrum},
                                  {13, "Left-Pallidum", kCerebrum},
                                  {14, "3rd-Ventricle", kVentricle},
                                  {15, "4th-Ventricle", kVentricle},
                                  {16, "Brain-Stem", kBrainstem},
                                  {17, "Left-Hippocampus", kCerebrum},
                                  {18, "Left-Amygdala", kCerebrum},
                                  {24, "CSF", kFluid},
                                  {25, "Left-Lesion", kCerebrum},
                                  {26, "Left-Accumbens-area", kCerebrum},
                                  {28, "Left-VentralDC", kCerebrum},
                                  {30, "Left-vessel", kCerebrum},
                                  {31, "Left-choroid-plexus", kVentricle},
                                  {41, "Right-Cerebral-White-Matter", kCerebrum},
                                  {42, "Right-Cerebral-Cortex", kCerebrum},
                                  {43, "Right-Lateral-Ventricle", kVentricle},
                                  {44, "Right-Inf-Lat-Vent", kVentricle},
                                  {46, "Right-Cerebellum-White-Matter", kCerebellum},
                                  {47, "Right-Cerebellum-Cortex", kCerebellum},
                                  {49, "Right-Thalamus", kCerebrum},
                                  {50, "Right-Caudate", kCerebrum},
                                  {51, "Right-Putamen", kCerebrum},
                                  {52, "Right-Pallidum", kCerebrum},
                                  {53, "Right-Hippocampus", kCerebrum},
                                  {54, "Right-Amygdala", kCerebrum},
                                  {57, "Right-Lesion", kCerebrum},
                                  {58, "Right-Accumbens-area", kCerebrum},
                                  {60, "Right-VentralDC", kCerebrum},
                                  {62, "Right-vessel", kCerebrum},
                                  {63, "Right-choroid-plexus", kVentricle},
                                  {72, "5th-Ventricle", kVentricle},
                                  {77, "WM-hypointensities", kCerebrum},
                                  {78, "Left-WM-hypointensities", kCerebrum},
                                  {79, "Right-WM-hypointensities", kCerebrum},
                                  {80, "non-WM-hypointensities", kCerebrum},
                                  {85, "Optic-Chiasm", kCerebrum},
                                  {251, "CC_Posterior", kCerebrum},
                                  {252, "CC_Mid_Posterior", kCerebrum},
                                  {253, "CC_Central", kCerebrum},
                                  {254, "CC_Mid_Anterior", kCerebrum},
                                  {255, "CC_Anterior", kCerebrum}};

// Letters and digits, lower case.
std::string plain(const std::string& name) {
  std::string letters;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0) letters += static_cast<char>(std::tolower(byte));
  }
  return letters;
}

using Voxels = std::vector<std::uint8_t>;

// Voxels with a neighbour (of six, inside the image) that has `value` take it.
void grow(Voxels& voxels, const std::array<int, 3>& dims, int axis, int steps, std::uint8_t value) {
  const auto along = static_cast<std::size_t>(axis);
  std::size_t stride = 1;
  for (std::size_t a = 0; a < along; ++a) stride *= static_cast<std::size_t>(dims[a]);
  const std::size_t length = static_cast<std::size_t>(dims[along]), slab = stride * length;
  for (int step = 0; step < steps; ++step) {
    const Voxels before = voxels;
    for (std::size_t v = 0; v < voxels.size(); ++v) {
      const std::size_t at = v % slab / stride;
      const bool reached = (at > 0 && before[v - stride] == value) ||
                           (at + 1 < length && before[v + stride] == value);
      if (reached) voxels[v] = value;
    }
  }
}

}  // namespace

Structure structure_of(int label) {
  for (const NamedLabel& known : kLabels) {
    if (known.number == label) return known.structure;
  }
  // aparc: cortex of the left and right, and white matter below it.
  const bool parcel = (label >= 1000 && label < 5000) || (label >= 11100 && label < 15000);
  return parcel ? kCerebrum : kOther;
}

Side side_of(int label) {
  for (const NamedLabel& known : kLabels) {
    if (known.number != label) continue;
    const std::string_view name = known.name;
    return name.starts_with("Left-")    ? Side::kLeft
           : name.starts_with("Right-") ? Side::kRight
                                        : Side::kNone;
  }
  if (structure_of(label) != kCerebrum) return Side::kNone;
  // 1000, 3000, 11100, 13100 left; 2000, 4000, 12100, 14100 right.
  return label / 1000 % 2 == 1 ? Side::kLeft : Side::kRight;
}

Matter matter_of(int label) {
  for (const NamedLabel& known : kLabels) {
    if (known.number != label) continue;
    const std::string_view name = known.name;
    if (name.ends_with("Cerebral-Cortex")) return Matter::kCortex;
    const bool nucleus =
        (label >= 10 && label <= 26 && label != 25) || (label >= 49 && label <= 58 && label != 57);
    return nucleus ? Matter::kNucleus : Matter::kWhite;
  }
  const int thousands = label / 1000;
  return thousands == 3 || thousands == 4 || thousands > 12 ? Matter::kWhite : Matter::kCortex;
}

VoxelImage with_freesurfer_numbers_of_aal(VoxelImage map) {
  const auto number_of = [](int label) {
    struct Nucleus {
      int aal, left, right;
    };
    constexpr Nucleus kNuclei[] = {{37, 17, 53}, {41, 18, 54}, {71, 11, 50},
                                   {73, 12, 51}, {75, 13, 52}, {77, 10, 49}};
    if (label < 1 || label > 116) return 0;
    if (label > 90) return label % 2 == 1 || label > 108 ? 8 : 47;
    for (const Nucleus& nucleus : kNuclei) {
      if (label == nucleus.aal) return nucleus.left;
      if (label == nucleus.aal + 1) return nucleus.right;
    }
    return label % 2 == 1 ? 3 : 42;
  };
  for (float& v : map.values) {
    v = std::isfinite(v) ? static_cast<float>(number_of(static_cast<int>(std::lround(v)))) : 0.0F;
  }
  return map;
}

Result<VoxelImage> with_freesurfer_numbers(const VoxelImage& map,
                                           const std::map<int, std::string>& names) {
  std::map<int, int> number_of;
  for (const auto& [label, name] : names) {
    for (const NamedLabel& known : kLabels) {
      std::string word = plain(name);
      if (word == plain("Left-Thalamus-Proper") || word == plain("Right-Thalamus-Proper")) {
        word.resize(word.size() - plain("Proper").size());
      }
      if (word == plain(known.name)) number_of[label] = known.number;
    }
  }
  if (number_of.empty()) {
    return invalid("none of the names of its table is FreeSurfer's, as Brain-Stem is");
  }
  VoxelImage renamed = map;
  for (float& v : renamed.values) {
    const auto found =
        std::isfinite(v) ? number_of.find(static_cast<int>(std::lround(v))) : number_of.end();
    v = found == number_of.end() ? 0.0F : static_cast<float>(found->second);
  }
  return renamed;
}

Result<VoxelImage> brain_from_labels(const VoxelImage& map, double closing_mm) {
  Voxels voxels(map.values.size(), 0);
  std::set<Structure> there;
  for (std::size_t v = 0; v < voxels.size(); ++v) {
    if (!std::isfinite(map.values[v])) continue;
    const Structure structure = structure_of(static_cast<int>(std::lround(map.values[v])));
    if (structure == kOther || structure == kFluid) continue;
    voxels[v] = 1;
    there.insert(structure);
  }
  if (there.count(kCerebrum) + there.count(kCerebellum) + there.count(kBrainstem) < 2) {
    return invalid(
        "has no two of cerebrum, cerebellum and brainstem by FreeSurfer's numbers (2, 3, 41, 42; "
        "7, "
        "8, 46, 47; 16); it has " +
        listed_labels(map));
  }
  for (const std::uint8_t value : {std::uint8_t{1}, std::uint8_t{0}}) {
    for (int axis = 0; axis < 3; ++axis) {
      const double step = map.T_ras_voxel.linear().col(axis).norm();
      grow(voxels, map.dims, axis, static_cast<int>(closing_mm / step), value);
    }
  }
  VoxelImage mask{map.dims, map.T_ras_voxel, std::vector<float>(voxels.begin(), voxels.end())};
  const double cc = geometry::mask_centre(mask).volume_mm3 / 1000.0;
  if (cc > kLargestBrain_cc) {
    return invalid(
        fmt::format("has {:.0f} cc of brain by FreeSurfer's numbers, at most {:.0f} are "
                    "one: is it an image, or a map by other numbers?",
                    cc, kLargestBrain_cc));
  }
  return mask;
}

}  // namespace brainshift::anatomy
