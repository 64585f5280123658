// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model/model_layout.hpp"

#include "common/io/config/config_file.hpp"
#include "common/values/model_id.hpp"

namespace brainshift::io {
namespace {

constexpr const char* kDistanceGroup = "tumour_distance";

void write_distance_grid(Hdf5Writer& out, const DistanceGrid& grid) {
  if (grid.empty()) return;
  out.group(kDistanceGroup);
  out.attribute(kDistanceGroup, "origin_mm", grid.origin_mm);
  out.number(kDistanceGroup, "spacing_mm", grid.spacing_mm);
  out.attribute(kDistanceGroup, "dims", grid.dims);
  out.list(std::string(kDistanceGroup) + "/values_mm", grid.values);
}

DistanceGrid read_distance_grid(const Hdf5Reader& in) {
  DistanceGrid grid;
  if (!in.has(kDistanceGroup)) return grid;
  const std::vector<double> origin = in.attribute<double>(kDistanceGroup, "origin_mm");
  const std::vector<int> dims = in.attribute<int>(kDistanceGroup, "dims");
  if (origin.size() != 3 || dims.size() != 3)
    throw Hdf5Problem{"attributes of tumour_distance are not three numbers each"};
  grid.origin_mm = Vec3(origin[0], origin[1], origin[2]);
  grid.spacing_mm = in.number<double>(kDistanceGroup, "spacing_mm");
  grid.dims = {dims[0], dims[1], dims[2]};
  grid.values = in.list<float>(std::string(kDistanceGroup) + "/values_mm");
  if (Status valid = validate(grid); !valid)
    throw Hdf5Problem{"tumour_distance: " + valid.error().message};
  return grid;
}

}  // namespace

void write_brain_model(Hdf5Writer& out, const BrainModel& model) {
  out.attribute("/", "case_id", model.case_id);
  out.attribute("/", "model_id", model.model_id);
  out.attribute("/", "gravity_direction", model.gravity_direction);
  out.number("/", "fluid_plane_depth_mm", model.fluid_plane_depth_mm);
  out.number("/", "slave_plane_depth_mm", model.slave_plane_depth_mm);
  for (const char* group : {"mesh", "skull", "tumour", "sets"}) out.group(group);
  out.matrix("mesh/nodes", model.mesh.nodes);
  out.matrix("mesh/tets", model.mesh.tets);
  out.list("mesh/labels", model.mesh.labels);
  out.matrix("boundary_triangles", model.boundary_triangles);
  out.matrix("skull/vertices", model.skull.vertices);
  out.matrix("skull/triangles", model.skull.triangles);
  out.matrix("tumour/vertices", model.tumour.vertices);
  out.matrix("tumour/triangles", model.tumour.triangles);
  out.list("sets/craniotomy", model.craniotomy);
  out.list("sets/brainstem", model.brainstem);
  out.list("sets/slaves", model.slaves);
  out.list("sets/fixed", model.fixed);
  write_distance_grid(out, model.tumour_distance);
}

BrainModel read_brain_model(const Hdf5Reader& in) {
  BrainModel model;
  model.case_id = in.attribute_text("/", "case_id");
  model.model_id = in.attribute_text("/", "model_id");
  const std::vector<double> gravity = in.attribute<double>("/", "gravity_direction");
  if (gravity.size() != 3) throw Hdf5Problem{"attribute gravity_direction is not three numbers"};
  model.gravity_direction = Vec3(gravity[0], gravity[1], gravity[2]);
  model.fluid_plane_depth_mm = in.number<double>("/", "fluid_plane_depth_mm");
  model.slave_plane_depth_mm = in.number<double>("/", "slave_plane_depth_mm");
  in.matrix("mesh/nodes", model.mesh.nodes);
  in.matrix("mesh/tets", model.mesh.tets);
  model.mesh.labels = in.list<int>("mesh/labels");
  in.matrix("boundary_triangles", model.boundary_triangles);
  in.matrix("skull/vertices", model.skull.vertices);
  in.matrix("skull/triangles", model.skull.triangles);
  in.matrix("tumour/vertices", model.tumour.vertices);
  in.matrix("tumour/triangles", model.tumour.triangles);
  model.craniotomy = in.list<int>("sets/craniotomy");
  model.brainstem = in.list<int>("sets/brainstem");
  model.slaves = in.list<int>("sets/slaves");
  model.fixed = in.list<int>("sets/fixed");
  model.tumour_distance = read_distance_grid(in);
  if (content_hash(model) != model.model_id) {
    throw Hdf5Problem{"content does not match its model_id (" + model.model_id +
                      "): the file was altered"};
  }
  return model;
}

void write_case(Hdf5Writer& out, const CaseConfig& config) {
  out.group("case");
  out.list("case/yaml", case_config_text(config));
  out.list("case/file", config.file.string());
}

CaseConfig read_case(const Hdf5Reader& in) {
  const std::string case_file = in.text("case/file");
  Result<CaseConfig> config = parse_case_config(in.text("case/yaml"), case_file);
  if (!config) throw Hdf5Problem{"case/yaml: " + config.error().message};
  config->file = case_file;
  return std::move(*config);
}

void write_inputs(Hdf5Writer& out, const std::vector<InputFile>& inputs) {
  out.group("inputs");
  for (const InputFile& input : inputs) {
    const std::string group = "inputs/" + input.key;
    out.group(group);
    out.attribute(group, "path", input.path.string());
    out.number(group, "bytes", input.bytes);
    out.number(group, "crc32", input.crc32);
  }
}

std::vector<InputFile> read_inputs(const Hdf5Reader& in) {
  std::vector<InputFile> inputs;
  for (const std::string& key : in.names("inputs")) {
    const std::string group = "inputs/" + key;
    inputs.push_back({key, in.attribute_text(group, "path"),
                      in.number<std::uint64_t>(group, "bytes"),
                      in.number<std::uint32_t>(group, "crc32")});
  }
  return inputs;
}

}  // namespace brainshift::io
