// SPDX-License-Identifier: GPL-3.0-or-later
// load_case_inputs of config_file.hpp.
#include "common/io/config/config_file.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/image_file.hpp"
#include "common/io/geometry/mesh_file.hpp"

namespace brainshift::io {
namespace {

// Moves a result into its place, or says which key named the file.
template <typename T>
Status store(const std::string& key, Result<T> result, std::optional<T>& place) {
  if (!result) return fail(result.error().code, key + ": " + result.error().message);
  place = std::move(*result);
  return {};
}

}  // namespace

Result<CaseInputs> load_case_inputs(const CaseConfig& config) {
  CaseInputs inputs;
  inputs.config = config;
  Status status;
  if (!config.mri.empty()) {
    if (Status mri = check_regular_file(config.mri); !mri) {
      return fail(mri.error().code, "images.mri: " + mri.error().message);
    }
  }
  if (const auto* file = std::get_if<MeshFile>(&config.mesh)) {
    status = store("mesh.file", read_tet_mesh(file->path), inputs.mesh);
  } else {
    status = store("images.brain", read_nifti(config.brain), inputs.brain);
  }
  if (!status) return tl::unexpected(status.error());

  if (const auto* label = std::get_if<TumourLabel>(&config.tumour)) {
    status = store("tumour.label_volume.file", read_nifti(label->path), inputs.tumour_labels);
  } else if (const auto* surface = std::get_if<TumourSurface>(&config.tumour)) {
    status = store("tumour.surface.file", read_surface(surface->path), inputs.tumour_surface);
  }
  if (!status) return tl::unexpected(status.error());

  if (config.contact.skull_file) {
    status = store("contact.skull_file", read_surface(*config.contact.skull_file), inputs.skull);
  }
  if (!status) return tl::unexpected(status.error());
  return inputs;
}

}  // namespace brainshift::io
