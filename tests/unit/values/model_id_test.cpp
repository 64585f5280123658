// SPDX-License-Identifier: Apache-2.0
#include "common/values/model_id.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <regex>
#include <set>
#include <utility>
#include <vector>

namespace brainshift {
namespace {

BrainModel example() {
  BrainModel model;
  model.case_id = "case";
  model.mesh.nodes.resize(3, 4);
  model.mesh.nodes << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  model.mesh.tets.resize(4, 1);
  model.mesh.tets << 0, 1, 2, 3;
  model.mesh.labels = {0};
  model.boundary_triangles.resize(3, 1);
  model.boundary_triangles << 0, 2, 1;
  model.skull.vertices = 2.0 * model.mesh.nodes;
  model.skull.triangles.resize(3, 1);
  model.skull.triangles << 0, 1, 3;
  model.tumour.vertices = 3.0 * model.mesh.nodes;
  model.tumour.triangles.resize(3, 1);
  model.tumour.triangles << 0, 2, 3;
  model.craniotomy = {0};
  model.brainstem = {1};
  model.slaves = {2};
  model.fixed = {3};
  model.fluid_plane_depth_mm = 1.0;
  model.slave_plane_depth_mm = 21.0;
  return model;
}

using Change = std::pair<const char*, std::function<void(BrainModel&)>>;

const std::vector<Change>& changes() {
  static const std::vector<Change> kChanges = {
      {"case_id", [](BrainModel& m) { m.case_id = "cash"; }},
      // The last bit of a coordinate.
      {"nodes", [](BrainModel& m) { m.mesh.nodes(0, 1) = std::nextafter(1.0, 2.0); }},
      {"number of nodes", [](BrainModel& m) { m.mesh.nodes.conservativeResize(3, 3); }},
      {"tets", [](BrainModel& m) { std::swap(m.mesh.tets(0, 0), m.mesh.tets(1, 0)); }},
      {"labels", [](BrainModel& m) { m.mesh.labels = {1}; }},
      {"no labels", [](BrainModel& m) { m.mesh.labels.clear(); }},
      {"boundary", [](BrainModel& m) { m.boundary_triangles(0, 0) = 3; }},
      {"skull vertices", [](BrainModel& m) { m.skull.vertices(2, 3) += 1e-9; }},
      {"skull triangles", [](BrainModel& m) { m.skull.triangles(2, 0) = 2; }},
      {"tumour vertices", [](BrainModel& m) { m.tumour.vertices(0, 0) = 1e-9; }},
      {"tumour triangles", [](BrainModel& m) { m.tumour.triangles(0, 0) = 1; }},
      {"craniotomy", [](BrainModel& m) { m.craniotomy = {}; }},
      {"brainstem", [](BrainModel& m) { m.brainstem = {}; }},
      {"slaves", [](BrainModel& m) { m.slaves = {}; }},
      {"fixed", [](BrainModel& m) { m.fixed = {}; }},
      // The same numbers, but in another set.
      {"set boundaries",
       [](BrainModel& m) {
         m.craniotomy = {0, 1}, m.brainstem = {};
       }},
      {"order of a set",
       [](BrainModel& m) {
         m.slaves = {3, 2}, m.fixed = {};
       }},
      {"order of a set, reversed",
       [](BrainModel& m) {
         m.slaves = {2, 3}, m.fixed = {};
       }},
      {"gravity", [](BrainModel& m) { m.gravity_direction = Vec3(0, 0, -1); }},
      {"fluid plane", [](BrainModel& m) { m.fluid_plane_depth_mm = 1.5; }},
      {"slave plane", [](BrainModel& m) { m.slave_plane_depth_mm = 21.5; }},
      {"planes swapped",
       [](BrainModel& m) { std::swap(m.fluid_plane_depth_mm, m.slave_plane_depth_mm); }},
  };
  return kChanges;
}

TEST(ContentHash, IsSixteenHexadecimalDigits) {
  EXPECT_TRUE(std::regex_match(content_hash(example()), std::regex("[0-9a-f]{16}")));
}

TEST(ContentHash, IsTheSameForTheSameModel) {
  EXPECT_EQ(content_hash(example()), content_hash(example()));
}

TEST(ContentHash, ChangesWithEveryField) {
  std::set<std::string> seen = {content_hash(example())};
  for (const auto& [name, change] : changes()) {
    BrainModel model = example();
    change(model);
    EXPECT_TRUE(seen.insert(content_hash(model)).second) << name;
  }
}

TEST(ContentHash, IgnoresTheStoredId) {
  BrainModel model = example();
  model.model_id = "something";
  EXPECT_EQ(content_hash(model), content_hash(example()));
}

}  // namespace
}  // namespace brainshift
