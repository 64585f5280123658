// SPDX-License-Identifier: GPL-3.0-or-later
// Which rotations and translations of a pose the points show, in numbers and in words.
//
// A ratio is the information about an axis divided by that about the best known of all six
// (rotation scaled by the points' rms radius). A ratio of 1e-2 means that the axis is known ten
// times worse.
// Ratios of rotations hold with the translation unknown. Ratios of translations hold with the
// rotation known: where one can be traded against the other, the translation does the work.
#pragma once

#include <string>
#include <vector>

#include "common/core/types.hpp"

namespace brainshift::registration {

struct Observability {
  // Ratios ascend, no unit. Column k of the axes belongs to ratio k: unit vectors in the surface's
  // frame.
  Vec3 rotation_ratios = Vec3::Zero();
  Mat3 rotation_axes = Mat3::Identity();
  Vec3 translation_ratios = Vec3::Zero();
  Mat3 translation_axes = Mat3::Identity();
  double threshold = 0.0;  // ratios below it are not observable

  bool rotation_shown(int k) const { return rotation_ratios[k] >= threshold; }
  bool translation_shown(int k) const { return translation_ratios[k] >= threshold; }
};

// One sentence per axis that is not observable: "rotation about (0.10, 0.90, 0.20) is not shown by
// the points". Where none of three is observable, one sentence for all: "no rotation is shown by
// the points". The largest component of an axis is positive. Empty when all are shown.
std::vector<std::string> not_shown(const Observability& seen);

}  // namespace brainshift::registration
