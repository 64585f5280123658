// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/anatomy/common_places.hpp"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "common/core/random.hpp"
#include "common/fem/space_elasticity.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/surface.hpp"

namespace brainshift::anatomy_study {
namespace {

// Uniform in a tetrahedron: the spacings of three sorted uniform numbers.
Eigen::Vector4d weights_in_tet(Random& random) {
  std::array<double, 3> cuts{};
  for (double& cut : cuts) cut = random.uniform();
  std::sort(cuts.begin(), cuts.end());
  return {cuts[0], cuts[1] - cuts[0], cuts[2] - cuts[1], 1.0 - cuts[2]};
}

// The sheets of some models, for distances.
class Sheets {
 public:
  static Result<Sheets> of(const std::vector<const BrainModel*>& models) {
    Sheets sheets;
    for (const BrainModel* model : models) {
      if (model->septa.triangles.cols() == 0) continue;
      auto index = geometry::ClosestPointIndex::build(
          geometry::surface_of(model->mesh.nodes, model->septa.triangles));
      if (!index) return tl::unexpected(index.error());
      sheets.indices_.push_back(std::move(*index));
    }
    return sheets;
  }
  bool clear(const Vec3& x) const {
    return std::all_of(indices_.begin(), indices_.end(), [&](const auto& index) {
      return index.closest(x).distance_mm >= kClear_mm;
    });
  }

 private:
  std::vector<geometry::ClosestPointIndex> indices_;
};

}  // namespace

Result<CommonPlaces> CommonPlaces::make(const outside::OutsideHead& truth, const bench::Head& with,
                                        const bench::Head& without, std::uint64_t seed) {
  const BrainModel& body = truth.mesh->model;
  const auto sheets = Sheets::of({&body, with.model.get(), without.model.get()});
  if (!sheets) return tl::unexpected(sheets.error());
  const TetMesh& mesh = body.mesh;
  std::vector<double> volumes;  // up to and with each tetrahedron
  for (int t = 0; t < mesh.num_tets(); ++t) {
    volumes.push_back((t > 0 ? volumes.back() : 0.0) + geometry::tet_volume(mesh, t));
  }
  Random random(seed);
  CommonPlaces places;
  for (int i = 0; i < kPlaces; ++i) {
    const double at = random.uniform() * volumes.back();
    const auto found = std::upper_bound(volumes.begin(), volumes.end(), at) - volumes.begin();
    Place place{std::min(static_cast<int>(found), mesh.num_tets() - 1), weights_in_tet(random),
                false};
    const Vec3 x = mesh.nodes(Eigen::all, mesh.tets.col(place.element)) * place.l;
    const geometry::TetLocation one = with.locator->locate(x), other = without.locator->locate(x);
    if (one.distance_mm > 0.0 || other.distance_mm > 0.0 || !sheets->clear(x)) continue;
    place.opened = truth.side_of(x) > 0.0;
    places.true_.push_back(place);
    places.with_.push_back(one);
    places.without_.push_back(other);
  }
  if (places.true_.empty()) {
    return fail(ErrorCode::kEmptySet, "no place lies in the tissue of all meshes");
  }
  return places;
}

// length: of the place with this number.
template <typename Length>
CommonPlaces::Means CommonPlaces::mean_of(const Length& length) const {
  std::array<double, 2> sums{};
  std::array<int, 2> counts{};
  for (std::size_t i = 0; i < true_.size(); ++i) {
    const std::size_t half = true_[i].opened ? 0 : 1;
    sums[half] += length(i);
    ++counts[half];
  }
  return {(sums[0] + sums[1]) / size(), sums[0] / counts[0], sums[1] / counts[1]};
}

CommonPlaces::Means CommonPlaces::motion(const fem::DisplacementSpace& space,
                                         const Points& u) const {
  return mean_of([&](std::size_t i) {
    return fem::displacement_at(space, u, true_[i].element, true_[i].l).norm();
  });
}

CommonPlaces::Means CommonPlaces::error(const fem::DisplacementSpace& space, const Points& u,
                                        const std::vector<geometry::TetLocation>& at,
                                        const Points& nodal) const {
  return mean_of([&](std::size_t i) {
    const Vec3 t = fem::displacement_at(space, u, true_[i].element, true_[i].l);
    return (geometry::value_at(at[i], nodal) - t).norm();
  });
}

CommonPlaces::Means CommonPlaces::error_with(const fem::DisplacementSpace& space, const Points& u,
                                             const Points& nodal) const {
  return error(space, u, with_, nodal);
}

CommonPlaces::Means CommonPlaces::error_without(const fem::DisplacementSpace& space,
                                                const Points& u, const Points& nodal) const {
  return error(space, u, without_, nodal);
}

}  // namespace brainshift::anatomy_study
