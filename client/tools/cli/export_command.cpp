// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "client/tools/cli/command.hpp"
#include "client/tools/export/export_surgery.hpp"

namespace brainshift::client {
namespace {

struct ExportArguments {
  ExportOptions options;
  std::string direction, sequence = "last";
  std::vector<std::string> formats;
  double spacing_mm = 0.0;
};

Status read_sequence(const std::string& text, UpdateChoice& choice) {
  if (text == "last") return {};
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) {
    return fail(ErrorCode::kInvalidArgument,
                "--sequence: \"" + text + "\": must be the number of an update, or last");
  }
  choice.sequence = number;
  return {};
}

Status read_direction(const std::string& text, ExportOptions& options) {
  if (text.empty()) return {};  // export_surgery explains both
  options.direction = io::field_direction(text);
  if (options.direction) return {};
  return fail(ErrorCode::kInvalidArgument,
              "--direction: \"" + text + "\": must be resampling or modeling");
}

void print_export(const Manifest& manifest, const ExportOptions& options) {
  const Update& update = manifest.message.update;
  const auto& [nx, ny, nz] = manifest.grid.dims;
  const Vec3 spacing = manifest.grid.spacing_mm();
  std::printf("%s: update %llu, quality %s, direction %s, up to %.2f mm\n", options.out.c_str(),
              static_cast<unsigned long long>(update.sequence),
              std::string(to_string(update.estimate.quality.quality)).c_str(),
              std::string(to_string(manifest.direction)).c_str(), manifest.largest_mm);
  std::printf("  %d x %d x %d voxels of %.4g x %.4g x %.4g mm, %zu in the brain\n", nx, ny, nz,
              spacing.x(), spacing.y(), spacing.z(), manifest.voxels_in_brain);
  const auto folded = (manifest.volume_ratios.array() <= 0.0).count();
  if (folded > 0) {
    std::printf("  %lld elements are turned inside out: no tissue does that\n",
                static_cast<long long>(folded));
  }
  for (const ManifestFile& file : manifest.files) {
    std::printf("  %-26s %s\n", file.file.c_str(), file.read_by.c_str());
  }
}

Status run_export(ExportArguments& arguments, bool spacing_given) {
  ExportOptions& options = arguments.options;
  if (Status ok = read_direction(arguments.direction, options); !ok) return ok;
  if (Status ok = read_sequence(arguments.sequence, options.choice); !ok) return ok;
  auto formats = parse_formats(arguments.formats);
  if (!formats) return tl::unexpected(formats.error());
  options.formats = std::move(*formats);
  if (spacing_given) options.spacing_mm = arguments.spacing_mm;
  options.software = "brainshift " BRAINSHIFT_VERSION;
  const auto manifest = export_surgery(options, terminal_progress());
  if (!manifest) return tl::unexpected(manifest.error());
  print_export(*manifest, options);
  return {};
}

constexpr const char* kFooter =
    "Directions:\n"
    "  resampling  x + v(x) is where the deformed point x was: warps images (ITK, ANTs, elastix,\n"
    "              plastimatch; 3D Slicer's from-parent), on the grid of the deformed brain\n"
    "  modeling    x + v(x) is where the undeformed point x goes: moves points and models\n"
    "              (3D Slicer's to-parent)\n"
    "Formats, --formats A,B: nifti-1007 nifti-1006 nrrd itk sd jacobian surfaces; series (every\n"
    "usable field, .vtu and .pvd, as journal export --vtu) on request; all.\n"
    "Examples:\n"
    "  The last usable field of a journal, and the MRI as the brain looks now, on the MRI's grid:\n"
    "    brainshift export journal/colin27-20250131T120000Z-1.surgery --model colin27.h5 \\\n"
    "      --direction resampling --like mri.nii.gz --image mri.nii.gz --out exported\n"
    "    antsApplyTransforms -d 3 -i mri.nii.gz -r mri.nii.gz -t exported/displacement-1007.nii.gz "
    "-o w.nii.gz\n"
    "  Update 12 for Slicer's models, 1 mm:\n"
    "    brainshift export a.surgery --model colin27.h5 --sequence 12 --direction modeling \\\n"
    "      --spacing-mm 1 --formats nrrd,surfaces --out for-slicer\n"
    "export.json says of every file its direction, frame, units, update and quality. The folder\n"
    "must not exist, or be empty; it appears whole or not at all. A simulated or imported surgery\n"
    "holds no field: replay it to a daemon that keeps a journal (docs/export.md).";

}  // namespace

void add_export(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand(
      "export", "Write a field of a journal for 3D Slicer, ITK, ANTs, elastix, ParaView.");
  ExportOptions& options = arguments->options;
  command->add_option("file", options.surgery, "surgery file with updates (a journal)")->required();
  command->add_option("--model", options.model, "prepared model (.h5) it was recorded with")
      ->required();
  command->add_option("--out", options.out, "folder to make; must not exist or be empty")
      ->required();
  command->add_option("--direction", arguments->direction,
                      "resampling or modeling; required, never implied");
  command->add_option("--sequence", arguments->sequence, "number of an update, or last (usable)")
      ->capture_default_str();
  command->add_option("--like", options.like, "NIfTI image whose grid to take; any affine");
  CLI::Option* spacing =
      command->add_option("--spacing-mm", arguments->spacing_mm,
                          "spacing of a grid around the brain, along RAS; 2 without --like");
  command
      ->add_option("--image", options.images,
                   "NIfTI image of the undeformed head to warp; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command->add_option("--formats", arguments->formats, "what to write; all but series if not given")
      ->delimiter(',');
  command->add_flag("--allow-unusable", options.choice.allow_unusable,
                    "with --sequence N: also an update that is unusable; every file says so");
  command->footer(kFooter);
  command->callback(
      [arguments, spacing, &status] { status = run_export(*arguments, spacing->count() > 0); });
}

}  // namespace brainshift::client
