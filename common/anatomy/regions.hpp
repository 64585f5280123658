// SPDX-License-Identifier: GPL-3.0-or-later
// The regions of a head that its label map tells apart, as a field for the mesher; and the places
// where left and right, or cerebrum and cerebellum, lie side by side without tissue that joins
// them.
//
// Each region's voxels are smoothed by a Gaussian, and a point belongs to the region with the
// largest value there: interfaces are smooth, and what is thinner than the Gaussian vanishes.
// Voxels without a label of the brain (sulci, vessels, white matter that an atlas leaves out)
// belong to the nearest region but ventricles.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/anatomy/brain_labels.hpp"
#include "common/anatomy/given_inputs.hpp"
#include "common/configuration/case_inputs.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::anatomy {

// Labels of the mesh while it is made. Regions that the case does not ask for are parts of others.
enum Region : int {
  kLeftGrey = 1,
  kRightGrey,
  kLeftWhite,
  kRightWhite,
  kCerebellumRegion,
  kBrainstemRegion,
  kVentricleRegion,
};
inline constexpr int kRegions = 7;
inline bool is_left(int region) { return region == kLeftGrey || region == kLeftWhite; }
inline bool is_right(int region) { return region == kRightGrey || region == kRightWhite; }
inline bool is_cerebral(int region) { return region >= kLeftGrey && region <= kRightWhite; }

// Which septum may lie between two regions.
enum class Septum { kNone, kFalx, kTentorium };
inline Septum septum_between(int a, int b) {
  if ((is_left(a) && is_right(b)) || (is_right(a) && is_left(b))) return Septum::kFalx;
  const bool tentorium =
      (is_cerebral(a) && b == kCerebellumRegion) || (is_cerebral(b) && a == kCerebellumRegion);
  return tentorium ? Septum::kTentorium : Septum::kNone;
}

class Regions {
 public:
  // inputs.labels: by the case's anatomy.numbers, or FreeSurfer's by inputs.label_names. what: key
  // and file, for messages. A ventricle's voxels inside the (closed) tumour are tissue. notes: what
  // the map does not tell apart, and how much tumour lies in ventricles. kInvalidArgument, one line
  // each: values that are no whole numbers, or that are no label of the brain; with septa a map
  // that does not separate left from right; a map that does not fit the brain's mask (kFarLabels,
  // kFarBrain).
  static Result<Regions> build(const CaseInputs& inputs, const TriangleSurface& tumour,
                               double smoothing_mm, const std::string& what, Notes* notes);

  // The region of a point of the head; any number within kRegions but never one that was not asked
  // for.
  int at(const Vec3& x) const;
  // Whether the map tells white from grey matter.
  bool tells_matter() const { return tells_matter_; }
  // No tissue joins the sides at a point of an interface: cortex of both (tentorium: cortex and
  // cerebellum) lies within kReach_mm, and neither white matter of both, brainstem nor a ventricle
  // within kClear_mm.
  bool parted(Septum septum, const Vec3& x) const;

  static constexpr double kReach_mm = 5.0, kClear_mm = 2.5;
  // Of the map's brain the share that may lie farther than kSlack_mm outside the mask, of the mask
  // the share that may lie farther than 20 mm from any label. AAL on its own head has 0.5 % there;
  // moved by 5 mm 4 to 5 %, by 10 mm 9 to 11 %.
  static constexpr double kSlack_mm = 3.0, kFarLabels = 0.04, kFarBrain = 0.05;

 private:
  struct Labels;  // the map, cut to the head
  static Result<Regions> build_from(const CaseInputs& inputs, const VoxelImage& map,
                                    const TriangleSurface& tumour, double smoothing_mm,
                                    const std::string& what, Notes* notes);
  std::shared_ptr<const Labels> labels_;
  std::array<int, 3> dims_{};  // of the smoothed values
  AffineTransform T_voxel_ras_ = AffineTransform::Identity();
  std::vector<float> values_;  // kRegions for each voxel
  bool tells_matter_ = false;
};

}  // namespace brainshift::anatomy
