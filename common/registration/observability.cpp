// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/observability.hpp"

#include <fmt/format.h>

namespace brainshift::registration {
namespace {

// An axis and its opposite are one; without a sign of zero.
Vec3 presentable(Vec3 axis) {
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  if (axis[largest] < 0.0) axis = -axis;
  for (double& value : axis) value = std::abs(value) < 0.005 ? 0.0 : value;
  return axis;
}

void add_sentences(const char* motion, const char* preposition, const Vec3& ratios,
                   const Mat3& axes, double threshold, std::vector<std::string>& sentences) {
  if ((ratios.array() < threshold).all()) {
    sentences.push_back(fmt::format("no {} is shown by the points", motion));
    return;
  }
  for (int k = 0; k < 3; ++k) {
    if (ratios[k] >= threshold) continue;
    const Vec3 axis = presentable(axes.col(k));
    sentences.push_back(fmt::format("{} {} ({:.2f}, {:.2f}, {:.2f}) is not shown by the points",
                                    motion, preposition, axis.x(), axis.y(), axis.z()));
  }
}

}  // namespace

std::vector<std::string> not_shown(const Observability& seen) {
  std::vector<std::string> sentences;
  add_sentences("rotation", "about", seen.rotation_ratios, seen.rotation_axes, seen.threshold,
                sentences);
  add_sentences("translation", "along", seen.translation_ratios, seen.translation_axes,
                seen.threshold, sentences);
  return sentences;
}

}  // namespace brainshift::registration
