// SPDX-License-Identifier: Apache-2.0
#include "common/values/model_id.hpp"

#include <cstdint>
#include <cstdio>

#include "common/core/fnv1a.hpp"

namespace brainshift {
namespace {

// Arrays by their size and their bytes, one after the other.
class ArrayHash {
 public:
  template <typename Derived>
  void add(const Eigen::PlainObjectBase<Derived>& matrix) {
    add_array(matrix.data(), matrix.size());
  }
  void add(const std::vector<int>& values) {
    add_array(values.data(), static_cast<Eigen::Index>(values.size()));
  }
  void add(const std::string& text) {
    add_array(text.data(), static_cast<Eigen::Index>(text.size()));
  }
  void add(const double* values, std::size_t count) { hash_.add(values, count * sizeof(double)); }
  std::uint64_t value() const { return hash_.value(); }

 private:
  template <typename T>
  void add_array(const T* data, Eigen::Index size) {
    const auto count = static_cast<std::uint64_t>(size);
    hash_.add(&count, sizeof count);
    hash_.add(data, static_cast<std::size_t>(size) * sizeof(T));
  }
  Fnv1a hash_;
};

}  // namespace

std::string content_hash(const BrainModel& model) {
  ArrayHash hash;
  hash.add(model.case_id);
  hash.add(model.mesh.nodes);
  hash.add(model.mesh.tets);
  hash.add(model.mesh.labels);
  hash.add(model.boundary_triangles);
  hash.add(model.skull.vertices);
  hash.add(model.skull.triangles);
  hash.add(model.tumour.vertices);
  hash.add(model.tumour.triangles);
  hash.add(model.craniotomy);
  hash.add(model.brainstem);
  hash.add(model.slaves);
  hash.add(model.fixed);
  if (!model.septa.slaves.empty() || model.ventricle_wall.cols() > 0) {
    hash.add(model.septa.slaves);
    hash.add(model.septa.normals);
    hash.add(&model.septa.gap_mm, 1);
    hash.add(model.septa.triangles);
    hash.add(model.ventricle_wall);
  }
  hash.add(model.gravity_direction);
  const double depths[] = {model.fluid_plane_depth_mm, model.slave_plane_depth_mm};
  hash.add(depths, 2);
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash.value()));
  return text;
}

}  // namespace brainshift
