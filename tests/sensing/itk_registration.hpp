// SPDX-License-Identifier: GPL-3.0-or-later
// The rigid registration of the Insight Toolkit, for comparison: Mattes mutual information, coarse
// to fine, on one thread.
//
// ITK 5.2 has an Eigen of its own, older and in the same namespace. Neither headers nor symbols of
// the two can be mixed. Therefore this interface has plain numbers only, and its library hides its
// symbols.
#pragma once

#include <array>
#include <memory>
#include <vector>

namespace brainshift::sensing {

// Voxel (i, j, k) lies at origin + columns (i, j, k).
struct ItkVolume {
  std::array<int, 3> dims{0, 0, 0};
  std::array<double, 3> origin_mm{0, 0, 0};
  std::array<std::array<double, 3>, 3> columns{};
  const std::vector<float>* values = nullptr;
  const std::vector<float>* mask = nullptr;  // used where > 0
};

// x -> A x + t.
struct ItkPose {
  bool ok = false;
  std::array<std::array<double, 3>, 3> A{};
  std::array<double, 3> t{0, 0, 0};
};

class __attribute__((visibility("default"))) ItkRegistration {
 public:
  ItkRegistration(const ItkVolume& fixed, const ItkVolume& moving);
  ~ItkRegistration();
  // From fixed to moving.
  ItkPose align(const ItkPose& initial) const;

 private:
  struct Images;
  std::unique_ptr<Images> images_;
};

}  // namespace brainshift::sensing
