// SPDX-License-Identifier: GPL-3.0-or-later
// A small model file with every part, and its first block made independently of the code under
// test.
#pragma once

#include <zlib.h>

#include <iomanip>
#include <sstream>
#include <string>

#include "common/io/config/config_file.hpp"
#include "common/io/model/model_file.hpp"
#include "common/values/model_id.hpp"

namespace brainshift::io::test_example {

// Values without symmetry, so that a swapped or transposed array shows.
inline ModelFile model_file() {
  ModelFile file;
  file.config = parse_case_config(R"(case_id: example
images: {brain: mask.nii}
tumour: {ellipsoid: {centre_mm: [1, 2, 3], semi_axes_mm: [4, 5, 6]}}
craniotomy: {centre_mm: [7, 8, 9]}
brainstem: {centre_mm: [0, 0, -60]}
gravity: {direction: [1, -2, 3]}
material: {poisson_ratio: 0.41}
)",
                                  "/cases/example.yaml")
                    .value();
  BrainModel& model = file.model;
  model.case_id = "example";
  model.mesh.nodes.resize(3, 5);
  for (Eigen::Index i = 0; i < 15; ++i) model.mesh.nodes.data()[i] = 0.1 * static_cast<double>(i);
  model.mesh.tets.resize(4, 2);
  model.mesh.tets << 0, 1, 1, 2, 2, 3, 3, 4;
  model.mesh.labels = {0, 3};
  model.boundary_triangles.resize(3, 2);
  model.boundary_triangles << 0, 1, 2, 3, 4, 0;
  model.skull.vertices = 2.0 * model.mesh.nodes.leftCols(4);
  model.skull.triangles.resize(3, 1);
  model.skull.triangles << 3, 1, 2;
  model.tumour.vertices = 0.3 * model.mesh.nodes.rightCols(3);
  model.tumour.triangles.resize(3, 1);
  model.tumour.triangles << 2, 1, 0;
  model.craniotomy = {4};
  model.brainstem = {0, 1};
  model.slaves = {2, 3};
  model.fixed = {};
  model.gravity_direction = Vec3(0.6, 0, -0.8);
  model.fluid_plane_depth_mm = -12.25;
  model.slave_plane_depth_mm = 7.75;
  model.tumour_distance.origin_mm = Vec3(-1.5, 2.25, 3.125);
  model.tumour_distance.spacing_mm = 0.75;
  model.tumour_distance.dims = {2, 3, 4};
  for (int i = 0; i < 24; ++i)
    model.tumour_distance.values.push_back(0.5f * static_cast<float>(i) - 3.0f);
  model.model_id = content_hash(model);
  return file;
}

// Numbers that differ from one array and place to the next; exact in single precision.
template <typename Matrix>
void count_up(Matrix& values, Eigen::Index rows, Eigen::Index columns, double from) {
  values.resize(rows, columns);
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    values.data()[i] = static_cast<typename Matrix::Scalar>(from + 0.125 * static_cast<double>(i));
  }
}

// Valid; even columns have bytes, odd ones longs.
inline CompactColumns responses(Eigen::Index columns, double from) {
  CompactParts parts;
  count_up(parts.steps, columns, 1, from + 10.0);
  parts.order = {4, 2, 0, 1, 3};
  parts.blocks = Eigen::Vector3i(5, 1, 2);
  count_up(parts.wide_basis, 15, 1, from);
  count_up(parts.basis, 30, 1, from);
  count_up(parts.basis_scales, 2, 1, from + 20.0);
  parts.lengths.setZero(3 * columns);
  for (Eigen::Index j = 0; j < columns; ++j) parts.lengths[3 * j + (j % 2 == 0 ? 2 : 0)] = 1;
  count_up(parts.longs, 8 * (columns / 2), 1, 1e6 * from);
  count_up(parts.bytes, 8 * ((columns + 1) / 2), 1, -100.0);
  return CompactColumns::from_parts(std::move(parts)).value();
}

// Columns of zeroes.
inline CompactColumns silent_responses(int nodes, Eigen::Index columns) {
  CompactParts parts;
  parts.steps.setOnes(columns);
  for (int i = 0; i < nodes; ++i) parts.order.push_back(i);
  parts.blocks.setZero(3, nodes);
  parts.lengths.setZero(3 * columns * nodes);
  parts.blocks.row(0).setOnes();
  return CompactColumns::from_parts(std::move(parts)).value();
}

inline constexpr auto kFinePart = static_cast<std::size_t>(PriorPart::kFine);

// Fits model_file(): 5 nodes, 3 modes, 2 slaves (the other way round than in the model), 2
// control nodes.
inline CondensedOperators operators(Boundary boundary) {
  CondensedOperators result;
  result.boundary = boundary;
  result.model_id = model_file().model.model_id;
  result.part_columns[0] = 2;
  result.part_columns[kFinePart] = 1;
  result.slaves = boundary == Boundary::kContact ? std::vector<int>{3, 2} : std::vector<int>{};
  const auto s = static_cast<Eigen::Index>(result.slaves.size());
  result.responses = responses(3 + s, boundary == Boundary::kContact ? 200 : 100);
  count_up(result.compliance, s, s, 300);
  result.compliance = (result.compliance + result.compliance.transpose()).eval();
  count_up(result.slave_modes, s, 3, 400);
  count_up(result.slave_normals, 3, s, 500);
  count_up(result.initial_penetration_mm, s, 1, -600);
  result.region = {0, 2, 4};
  count_up(result.region_responses, 9, 3 + s, 900);
  result.control = {1, 3};
  count_up(result.truncated_variance_mm2, 2, kRemainders, 700);
  result.control_neighbours.resize(4, 5);
  for (int i = 0; i < 20; ++i) result.control_neighbours.data()[i] = i % 3 == 0 ? 1 : 0;
  count_up(result.control_weights, 4, 5, 800);
  return result;
}

inline ModelFile condensed_file() {
  ModelFile file = model_file();
  file.condensed = {operators(Boundary::kContact), operators(Boundary::kFixed)};
  file.inputs = {{"case", "/cases/example.yaml", 1234, 0x89abcdefu},
                 {"images.brain", "/cases/mask.nii", std::uint64_t{5} << 40, 7}};
  return file;
}

// The first block as the header of model_file.hpp describes it.
inline std::string with_header(const std::string& bytes) {
  const std::string body = bytes.substr(512);
  const auto crc =
      crc32(0L, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
  std::ostringstream header;
  header << "brainshift model file\nformat 7\nbytes " << bytes.size() << "\ncrc32 " << std::hex
         << std::setw(8) << std::setfill('0') << crc << "\n";
  std::string block = header.str();
  block.resize(512, '\0');
  return block + body;
}

}  // namespace brainshift::io::test_example
