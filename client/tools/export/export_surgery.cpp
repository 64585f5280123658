// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/export/export_surgery.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <set>
#include <system_error>
#include <utility>

#include "client/tools/export/sample_field.hpp"
#include "client/tools/export/warp.hpp"
#include "client/tools/journal/journal_export.hpp"
#include "common/geometry/surface.hpp"
#include "common/io/fields/field_files.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/output_path.hpp"
#include "common/io/geometry/image_file.hpp"
#include "common/io/geometry/mesh_writer.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;
using io::FieldDirection;

// "PREFIX: MESSAGE"
tl::unexpected<Error> about(const std::string& prefix, const Error& error) {
  return fail(error.code, prefix + ": " + error.message);
}

// scan.nii.gz -> scan
std::string stem_of(const fs::path& image) {
  fs::path stem = image.stem();
  if (io::lower_extension(stem) == ".nii") stem = stem.stem();
  return stem.string();
}

Status check_options(const ExportOptions& options) {
  if (!options.direction) {
    return invalid(
        "--direction is missing and is never implied: resampling warps images onto the deformed "
        "brain (ITK, ANTs, elastix; Slicer's from-parent), modeling moves points and models to "
        "their deformed places (Slicer's to-parent)");
  }
  if (!options.like.empty() && options.spacing_mm) {
    return invalid("--spacing-mm: not with --like, whose grid has a spacing");
  }
  if (!options.images.empty() && *options.direction == FieldDirection::kModeling) {
    return invalid("--image: needs --direction resampling, by which images are warped");
  }
  std::set<std::string> stems;
  for (const fs::path& image : options.images) {
    if (!stems.insert(stem_of(image)).second) {
      return invalid(fmt::format("--image: {}: another image is called {} too", image.string(),
                                 stem_of(image)));
    }
  }
  return {};
}

// The folder with links resolved and without a slash at its end. It does not exist, or is empty.
Result<fs::path> checked_folder(const fs::path& named) {
  if (Status ok = io::check_output_folder("--out", named); !ok) return tl::unexpected(ok.error());
  std::error_code failed;
  fs::path folder = fs::weakly_canonical(fs::absolute(named), failed);
  if (!folder.has_filename()) folder = folder.parent_path();
  if (failed) return about("--out", {ErrorCode::kInvalidArgument, failed.message()});
  if (fs::exists(folder, failed) && !fs::is_empty(folder, failed)) {
    return invalid(fmt::format("--out: {}: is not empty: an export does not mix with other files",
                               named.string()));
  }
  return folder;
}

// A folder beside the final one, which takes its name when it is complete.
class PendingFolder {
 public:
  static Result<PendingFolder> create(const fs::path& folder) {
    PendingFolder pending(
        folder, folder.parent_path() /
                    fmt::format(".{}.partial-{}", folder.filename().string(), ::getpid()));
    std::error_code failed;
    fs::create_directories(folder.parent_path(), failed);
    const bool made = !failed && fs::create_directory(pending.place_, failed);
    if (made) return pending;
    const fs::path place = std::exchange(pending.place_, fs::path());  // somebody else's
    return io::write_failed(place, failed ? failed.message() : "exists already");
  }
  PendingFolder(PendingFolder&& other) noexcept
      : folder_(std::move(other.folder_)), place_(std::exchange(other.place_, fs::path())) {}
  PendingFolder& operator=(PendingFolder&&) = delete;
  ~PendingFolder() {
    std::error_code ignored;
    if (!place_.empty()) fs::remove_all(place_, ignored);
  }
  const fs::path& place() const { return place_; }
  Status commit() {
    std::error_code failed;
    fs::rename(place_, folder_, failed);
    if (failed) return io::write_failed(folder_, failed.message());
    place_.clear();
    return {};
  }

 private:
  PendingFolder(fs::path folder, fs::path place)
      : folder_(std::move(folder)), place_(std::move(place)) {}
  fs::path folder_, place_;
};

struct NamedImage {
  std::string stem;
  fs::path path;
  VoxelImage image;
};

// All that is read.
struct Inputs {
  io::SurgeryFile file;
  BrainModel model;
  ChosenUpdate chosen;
  io::VoxelGrid grid;
  std::vector<NamedImage> images;
};

Result<io::VoxelGrid> grid_of(const ExportOptions& options, const TetMesh& mesh, const Points& u) {
  if (options.like.empty()) {
    const double spacing = options.spacing_mm.value_or(kDefaultExportSpacing_mm);
    auto grid = grid_around_brain(mesh, u, spacing, options.taper);
    if (!grid) return about("--spacing-mm", grid.error());
    return grid;
  }
  const auto image = io::read_nifti(options.like);
  if (!image) return about("--like", image.error());
  auto grid = grid_like(*image);
  if (!grid) return about("--like: " + options.like.string(), grid.error());
  return grid;
}

Result<Inputs> read_inputs(const ExportOptions& options) {
  auto file = io::SurgeryFile::open(options.surgery);
  if (!file) return tl::unexpected(file.error());
  auto model = recorded_model(*file, options.surgery, options.model);
  if (!model) return tl::unexpected(model.error());
  auto chosen = choose_update(*file, options.surgery, model->mesh.num_nodes(), options.choice);
  if (!chosen) return tl::unexpected(chosen.error());
  auto grid = grid_of(options, model->mesh, chosen->message.update.estimate.displacement);
  if (!grid) return tl::unexpected(grid.error());
  std::vector<NamedImage> images;
  for (const fs::path& path : options.images) {
    auto image = io::read_nifti(path);
    if (!image) return about("--image", image.error());
    images.push_back({stem_of(path), path, std::move(*image)});
  }
  return Inputs{std::move(*file), std::move(*model), std::move(*chosen), *grid, std::move(images)};
}

// Writes the files one by one, and keeps the list of them.
class Writing {
 public:
  Writing(const ExportOptions& options, const Inputs& inputs, fs::path place, Manifest& manifest)
      : options_(options),
        inputs_(inputs),
        place_(std::move(place)),
        manifest_(manifest),
        direction_(to_string(*options.direction)),
        prefix_(inputs.chosen.message.update.usable() ? "" : "unusable-") {}

  Status series() {
    if (!wants(ExportFormat::kSeries)) return {};
    const fs::path folder = place_ / "series";
    const auto fields = write_field_series(inputs_.file, options_.surgery, inputs_.model, folder);
    if (!fields) return tl::unexpected(fields.error());
    manifest_.files.push_back(
        {"series/" + options_.surgery.stem().string() + ".pvd",
         fmt::format("{} usable fields on the undeformed mesh by time: displacement, sd_mm, known",
                     *fields),
         "modeling", "RAS", "RAS", "mm", "ParaView (Warp By Vector); each .vtu also 3D Slicer",
         false});
    return {};
  }

  Status fields(const io::DisplacementField& field) {
    return nifti(field, ExportFormat::kNiftiLps, io::VectorFrame::kLps, "displacement-1007.nii.gz",
                 "ITK, SimpleITK, ANTs, plastimatch")
        .and_then([&] {
          return nifti(field, ExportFormat::kNiftiRas, io::VectorFrame::kRas,
                       "displacement-1006.nii.gz", "3D Slicer, nibabel, wb_command");
        })
        .and_then([&]() -> Status {
          if (!wants(ExportFormat::kNrrd)) return {};
          const std::string name = list_field("displacement.nrrd", "LPS", "LPS", nrrd_readers());
          return io::write_nrrd(place_ / name, field);
        })
        .and_then([&]() -> Status {
          if (!wants(ExportFormat::kItk)) return {};
          const std::string name = list_field("displacement.h5", "LPS", "LPS",
                                              "ITK 5, SimpleITK, ANTs; 3D Slicer as from-parent");
          return io::write_itk_transform(place_ / name, field);
        });
  }

  Status volumes(const FieldSamples& samples) {
    if (wants(ExportFormat::kSd) && !samples.sd_mm.values.empty()) {
      if (Status ok =
              scalar(samples.sd_mm, "sd_mm.nii.gz",
                     "standard deviation of the displacement; 0 outside of the brain", "mm");
          !ok) {
        return ok;
      }
    }
    if (wants(ExportFormat::kKnown) && !samples.known.values.empty()) {
      if (Status ok =
              scalar(samples.known, "known.nii.gz",
                     "share of the standard deviation that the data took away: 0 a guess from the "
                     "prior alone, 1 known; 0 outside of the brain",
                     "1");
          !ok) {
        return ok;
      }
    }
    if (!wants(ExportFormat::kJacobian)) return {};
    return scalar(samples.jacobian, "jacobian.nii.gz",
                  "volume of the tissue after over before, det(I + grad u); below 1 compressed, 0 "
                  "and below folded; 1 outside of the brain",
                  "1");
  }

  Status image(const io::ScalarVolume& warped, const std::string& stem) {
    return scalar(warped, "warped-" + stem + ".nii.gz",
                  "the image as the deformed brain looks, linear interpolation", "of the image");
  }

  Status surfaces() {
    if (!wants(ExportFormat::kSurfaces)) return {};
    const Estimate& estimate = inputs_.chosen.message.update.estimate;
    const Uncertainty of{estimate.sd_mm, estimate.known};
    const auto write = [&](const std::string& name, const DeformedSurface& made) -> Status {
      const std::string file =
          list({name, "deformed surface; vertices carry displacement_mm, sd_mm and known",
                "modeling", "RAS", "RAS", "mm", "3D Slicer, ParaView, VTK"});
      return io::write_surface(place_ / file, made.surface, made.vertex_fields);
    };
    const BrainModel& model = inputs_.model;
    const Points& u = estimate.displacement;
    Status status = write("tumour.vtp", deformed_tumour(model, u, of));
    for (const auto& [name, triangles] : {std::pair{"cortex.vtp", &model.boundary_triangles},
                                          {"ventricles.vtp", &model.ventricle_wall}}) {
      if (status && triangles->cols() > 0) {
        status = write(name, deformed_triangles(model, *triangles, u, of));
      }
    }
    if (!status || model.septa.triangles.cols() == 0) return status;
    const std::string file = list({"septa.vtp", "falx and tentorium, which stay where they are", "",
                                   "RAS", "RAS", "mm", "3D Slicer, ParaView, VTK"});
    return io::write_surface(place_ / file,
                             geometry::surface_of(model.mesh.nodes, model.septa.triangles), {});
  }

  Status manifest() const { return io::write_file(place_ / "export.json", to_json(manifest_)); }

 private:
  bool wants(ExportFormat format) const { return options_.formats.count(format) > 0; }
  std::string list(ManifestFile file) {
    file.file = prefix_ + file.file;
    manifest_.files.push_back(file);
    return file.file;
  }
  std::string list_field(const std::string& name, const std::string& points,
                         const std::string& vectors, const std::string& read_by) {
    return list({name, "displacement field", direction_, points, vectors, "mm", read_by});
  }
  std::string nrrd_readers() const {
    return *options_.direction == FieldDirection::kModeling
               ? "3D Slicer 5.10 or newer; all others would take it for resampling"
               : "3D Slicer, elastix (transformix), plastimatch";
  }
  Status nifti(const io::DisplacementField& field, ExportFormat format, io::VectorFrame vectors,
               const std::string& name, const std::string& read_by) {
    if (!wants(format)) return {};
    const std::string file = list_field(name, "RAS", std::string(to_string(vectors)), read_by);
    return io::write_nifti(place_ / file, field, vectors);
  }
  Status scalar(const io::ScalarVolume& volume, const std::string& name, const std::string& content,
                const std::string& units) {
    const std::string file =
        list({name, content, "", "RAS", "", units, "any program that reads NIfTI"});
    return io::write_nifti(place_ / file, volume);
  }

  const ExportOptions& options_;
  const Inputs& inputs_;
  fs::path place_;
  Manifest& manifest_;
  std::string direction_;
  std::string prefix_;
};

std::string note_of(const Update& update) {
  const std::string quality(to_string(update.estimate.quality.quality));
  return fmt::format("update {}, {}", update.sequence,
                     update.usable() ? quality : "NOT USABLE: " + quality);
}

Manifest manifest_of(const ExportOptions& options, const Inputs& inputs,
                     const FieldSamples& samples) {
  Manifest manifest;
  manifest.software = options.software;
  manifest.surgery = options.surgery.filename().string();
  manifest.case_id = inputs.model.case_id;
  manifest.message = inputs.chosen.message;
  manifest.time_s = inputs.chosen.time_s;
  manifest.direction = *options.direction;
  manifest.grid = inputs.grid;
  manifest.voxels_in_brain = samples.voxels_inside;
  manifest.largest_mm = samples.largest_mm;
  manifest.taper = options.taper;
  manifest.volume_ratios =
      volume_ratios(inputs.model.mesh, inputs.chosen.message.update.estimate.displacement);
  return manifest;
}

Result<FieldSamples> samples_of(const ExportOptions& options, const Inputs& inputs,
                                const Progress& progress) {
  const Update& update = inputs.chosen.message.update;
  auto samples = sample_field(inputs.model.mesh, update.estimate.displacement,
                              {update.estimate.sd_mm, update.estimate.known}, inputs.grid,
                              *options.direction, options.taper, progress);
  if (!samples) {
    return about(fmt::format("{}: update {}", options.surgery.string(), update.sequence),
                 samples.error());
  }
  if (samples->voxels_inside == 0) {
    return invalid(
        fmt::format("--like: {}: no voxel lies in the brain: is it in the patient's RAS frame?",
                    options.like.string()));
  }
  for (std::string* note : {&samples->field.note, &samples->sd_mm.note, &samples->known.note,
                            &samples->jacobian.note}) {
    *note = note_of(update);
  }
  return samples;
}

}  // namespace

Result<Manifest> export_surgery(const ExportOptions& options, const Progress& progress) {
  if (Status ok = check_options(options); !ok) return tl::unexpected(ok.error());
  const auto folder = checked_folder(options.out);
  if (!folder) return tl::unexpected(folder.error());
  const auto inputs = read_inputs(options);
  if (!inputs) return tl::unexpected(inputs.error());
  const auto samples = samples_of(options, *inputs, progress);
  if (!samples) return tl::unexpected(samples.error());

  auto pending = PendingFolder::create(*folder);
  if (!pending) return tl::unexpected(pending.error());
  Manifest manifest = manifest_of(options, *inputs, *samples);
  Writing writing(options, *inputs, pending->place(), manifest);
  report(progress, "writing", 0.0);
  Status ok = writing.series()
                  .and_then([&] { return writing.fields(samples->field); })
                  .and_then([&] { return writing.volumes(*samples); })
                  .and_then([&] { return writing.surfaces(); });
  for (const NamedImage& one : inputs->images) {
    if (!ok) break;
    const auto warped = warp_image(one.image, samples->field);
    if (!warped) return about("--image: " + one.path.string(), warped.error());
    ok = writing.image(*warped, one.stem);
  }
  if (ok) ok = writing.manifest();
  if (ok) ok = pending->commit();
  if (!ok) return tl::unexpected(ok.error());
  report(progress, "writing", 1.0);
  return manifest;
}

}  // namespace brainshift::client
