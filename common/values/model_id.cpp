// SPDX-License-Identifier: Apache-2.0
#include "common/values/model_id.hpp"

#include <cstdint>
#include <cstdio>

namespace brainshift {
namespace {

class Fnv1a {
 public:
  template <typename T>
  void add_array(const T* data, std::size_t count) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(data);
    add_bytes(bytes, count * sizeof(T));
  }
  void add_size(std::size_t n) {
    const auto n64 = static_cast<std::uint64_t>(n);
    add_array(&n64, 1);
  }
  template <typename Derived>
  void add(const Eigen::PlainObjectBase<Derived>& matrix) {
    add_size(static_cast<std::size_t>(matrix.size()));
    add_array(matrix.data(), static_cast<std::size_t>(matrix.size()));
  }
  void add(const std::vector<int>& values) {
    add_size(values.size());
    add_array(values.data(), values.size());
  }
  void add(const std::string& text) {
    add_size(text.size());
    add_array(text.data(), text.size());
  }
  std::uint64_t value() const { return hash_; }

 private:
  void add_bytes(const unsigned char* bytes, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      hash_ ^= bytes[i];
      hash_ *= 1099511628211ull;
    }
  }
  std::uint64_t hash_ = 14695981039346656037ull;
};

}  // namespace

std::string content_hash(const BrainModel& model) {
  Fnv1a hash;
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
  hash.add(model.gravity_direction);
  const double depths[] = {model.fluid_plane_depth_mm, model.slave_plane_depth_mm};
  hash.add_array(depths, 2);
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash.value()));
  return text;
}

}  // namespace brainshift
