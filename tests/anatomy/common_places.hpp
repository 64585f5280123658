// SPDX-License-Identifier: GPL-3.0-or-later
// Places of a head where a true field and those of two models are compared: points of tissue, so
// that neither mesh's nodes weigh more.
#pragma once

#include <cstdint>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/geometry/tet_locator.hpp"
#include "tests/benchmarks/bench_head.hpp"
#include "tests/surgeries/outside/outside_head.hpp"

namespace brainshift::anatomy_study {

// Places this close to a sheet of any of the meshes are left out: its slits lie apart by a part of
// an edge, and a place between them is on one side in one mesh and on the other in another.
inline constexpr double kClear_mm = 3.0;
inline constexpr int kPlaces = 5000;  // drawn

class CommonPlaces {
 public:
  // kPlaces points of the truth's mesh, uniform by volume; those that stay lie in the tissue of
  // both models and kClear_mm from every sheet. The same seed gives the same places. kEmptySet:
  // none stays. Errors of geometry::ClosestPointIndex.
  static Result<CommonPlaces> make(const outside::OutsideHead& truth, const bench::Head& with,
                                   const bench::Head& without, std::uint64_t seed);

  int size() const { return static_cast<int>(true_.size()); }
  // Mean lengths, mm, over the places: of the true motion, u: 3 x nodes of the truth's space; and
  // of a model's field minus it, nodal: 3 x nodes of that model.
  struct Means {
    double all = 0.0, opened = 0.0, other = 0.0;  // the half with the opening and the other one
  };
  Means motion(const fem::DisplacementSpace& space, const Points& u) const;
  Means error_with(const fem::DisplacementSpace& space, const Points& u, const Points& nodal) const;
  Means error_without(const fem::DisplacementSpace& space, const Points& u,
                      const Points& nodal) const;

 private:
  struct Place {
    int element;
    Eigen::Vector4d l;
    bool opened;
  };
  template <typename Length>
  Means mean_of(const Length& length) const;
  Means error(const fem::DisplacementSpace& space, const Points& u,
              const std::vector<geometry::TetLocation>& at, const Points& nodal) const;

  std::vector<Place> true_;
  std::vector<geometry::TetLocation> with_, without_;
};

}  // namespace brainshift::anatomy_study
