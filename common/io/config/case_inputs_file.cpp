// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/case_inputs_file.hpp"

#include "common/configuration/case_keys.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/image_file.hpp"
#include "common/io/geometry/label_map_file.hpp"
#include "common/io/geometry/mesh_file.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

class Loader {
 public:
  explicit Loader(const CaseConfig& config) : config_(config) {}

  // Puts what `read` makes of the file into its place. An error names the key. Nothing happens
  // after the first error.
  template <typename Read, typename T>
  void load(const fs::path& member, const Read& read, std::optional<T>& place) {
    if (!status_) return;
    auto result = read(member);
    if (result) {
      place = std::move(*result);
    } else {
      blame(member, result.error());
    }
  }
  void look_up(const fs::path& member) {
    if (member.empty() || !status_) return;
    if (Status found = check_regular_file(member); !found) blame(member, found.error());
  }
  const Status& status() const { return status_; }

 private:
  void blame(const fs::path& member, const Error& error) {
    status_ = fail(error.code, key_of(config_, member) + ": " + error.message);
  }
  const CaseConfig& config_;
  Status status_;
};

}  // namespace

Result<CaseInputs> load_case_inputs(const CaseConfig& config) {
  CaseInputs inputs;
  inputs.config = config;
  Loader loader(config);
  loader.look_up(config.mri);
  if (const auto* file = std::get_if<MeshFile>(&config.mesh)) {
    loader.load(file->path, read_tet_mesh, inputs.mesh);
  } else {
    loader.load(config.brain, read_nifti, inputs.brain);
  }
  if (const auto* label = std::get_if<TumourLabel>(&config.tumour)) {
    const LabelChoice choice{label->segment.value_or(""), label->label};
    const auto read = [&](const fs::path& path) { return read_label_map(path, choice); };
    loader.load(label->path, read, inputs.tumour_labels);
  } else if (const auto* surface = std::get_if<TumourSurfaceFile>(&config.tumour)) {
    loader.load(surface->path, read_surface, inputs.tumour_surface);
  }
  if (config.contact.skull_file) {
    loader.load(*config.contact.skull_file, read_surface, inputs.skull);
  }
  if (!loader.status()) return tl::unexpected(loader.status().error());
  return inputs;
}

}  // namespace brainshift::io
