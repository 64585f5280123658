// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "client/tools/cli/command.hpp"
#include "client/tools/export/export_surgery.hpp"
#include "client/tools/journal/journal_check.hpp"
#include "client/tools/journal/journal_copy.hpp"
#include "client/tools/journal/journal_export.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/recording/surgery_file.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

struct JournalArguments {
  std::vector<fs::path> files;
  fs::path file;
  fs::path out;
  fs::path csv;
  fs::path model;
  fs::path fields_folder;
  fs::path fields_file;
  std::uint64_t first = 0;
  std::uint64_t last = 0;
};

// Every file is reported; the first that is not good decides how the command ends.
Status run_check(const std::vector<fs::path>& files) {
  Status status;
  for (const fs::path& file : files) {
    const auto checked = check_journal(file);
    if (!checked) {
      if (!status) print_error(status.error().message);
      status = tl::unexpected(checked.error());
      continue;
    }
    print_lines(report_lines(*checked));
    if (status && checked->broken) status = tl::unexpected(*checked->broken);
  }
  return status;
}

Status export_tables(const JournalArguments& arguments) {
  const bool fields_wanted = !arguments.fields_folder.empty() || !arguments.fields_file.empty();
  if (arguments.csv.empty() && !fields_wanted) {
    return invalid("journal export: give --csv, or --vtu or --hdf5 with --model");
  }
  if (fields_wanted == arguments.model.empty()) {
    return invalid("journal export: --model needs --vtu or --hdf5, and they need it");
  }
  const auto file = io::SurgeryFile::open(arguments.file);
  if (!file) return tl::unexpected(file.error());
  if (!arguments.csv.empty()) {
    const auto csv = records_csv(*file, arguments.file);
    if (!csv) return tl::unexpected(csv.error());
    if (Status ok = io::write_file(arguments.csv, *csv); !ok) return ok;
    std::printf("%s: %llu records\n", arguments.csv.c_str(),
                static_cast<unsigned long long>(file->state().records));
  }
  if (!fields_wanted) return {};
  const auto model = recorded_model(*file, arguments.file, arguments.model);
  if (!model) return tl::unexpected(model.error());
  if (!arguments.fields_folder.empty()) {
    const auto fields = write_field_series(*file, arguments.file, *model, arguments.fields_folder);
    if (!fields) return tl::unexpected(fields.error());
    std::printf("%s: %d fields\n", arguments.fields_folder.c_str(), *fields);
  }
  if (arguments.fields_file.empty()) return {};
  const auto fields = write_field_file(*file, arguments.file, *model, arguments.fields_file);
  if (!fields) return tl::unexpected(fields.error());
  std::printf("%s: %d fields\n", arguments.fields_file.c_str(), *fields);
  return {};
}

Status finish(const Result<CopiedJournal>& copied, const fs::path& out) {
  if (!copied) return tl::unexpected(copied.error());
  std::printf("%s: %llu of %llu records\n", out.c_str(),
              static_cast<unsigned long long>(copied->kept),
              static_cast<unsigned long long>(copied->of));
  if (copied->broken) std::printf("  left out from: %s\n", copied->broken->message.c_str());
  return {};
}

CLI::App* add_journal_action(CLI::App& journal, const std::string& name, const std::string& text,
                             const std::string& examples) {
  CLI::App* action = journal.add_subcommand(name, text);
  action->footer(examples);
  return action;
}

void add_check(CLI::App& journal, const std::shared_ptr<JournalArguments>& arguments,
               Status& status) {
  CLI::App* action = add_journal_action(
      journal, "check", "Report what files hold, and whether every record is as it was written.",
      "Examples:\n"
      "  brainshift journal check journal/*.surgery\n"
      "  brainshift journal check crashed.surgery && brainshift replay crashed.surgery --report "
      "r.json\n"
      "A file that was not closed is no error: it crashed, is still written, or lost its -wal "
      "file\n"
      "when it was copied. Exit status: 0 all records are good; 2 a file is damaged or is not a "
      "surgery file.");
  add_required(*action, "files", arguments->files, "surgery files (.surgery)");
  action->callback([arguments, &status] { status = run_check(arguments->files); });
}

void add_export(CLI::App& journal, const std::shared_ptr<JournalArguments>& arguments,
                Status& status) {
  CLI::App* action = add_journal_action(
      journal, "export",
      "Write a table of the records, and the fields for ParaView or as one HDF5 file.",
      R"(Examples:
  brainshift journal export paper.surgery --csv paper.csv
  brainshift journal export journal/colin27-20250131T120000Z-1.surgery --csv records.csv \
    --vtu fields --hdf5 fields.h5 --model colin27.h5
The table has a row per record: kind, sequence, source, time, bytes; of decisions the
outcome; of updates status, quality, flags, times of the stages, active slaves and the
largest motion. The series has a .vtu per usable update and a .pvd that lists them by time.
The HDF5 file holds the mesh, and a group per usable update with displacement_mm (n x 3) and
sd_mm (n), both in patient RAS. A broken file must be repaired first.)");
  add_required(*action, "file", arguments->file, "surgery file (.surgery)");
  action->add_option("--csv", arguments->csv, "table to write; replaced if it exists");
  action->add_option("--vtu", arguments->fields_folder, "folder for the fields; needs --model");
  action->add_option("--hdf5", arguments->fields_file,
                     "one file of all fields to write (.h5); needs --model");
  action->add_option("--model", arguments->model,
                     "prepared model (.h5) that the surgery was recorded with");
  action->callback([arguments, &status] { status = export_tables(*arguments); });
}

void add_repair(CLI::App& journal, const std::shared_ptr<JournalArguments>& arguments,
                Status& status) {
  CLI::App* action =
      add_journal_action(journal, "repair", "Write the valid prefix of a file to a new one.",
                         R"(Example:
  brainshift journal repair damaged.surgery --out mended.surgery
The original is only read. Everything in front of the first broken record is kept; the gap
of the new file says where it comes from. Of a crashed file it makes a closed one.)");
  add_required(*action, "file", arguments->file, "surgery file (.surgery)");
  add_required(*action, "--out", arguments->out, "surgery file to make; must not exist");
  action->callback([arguments, &status] {
    status = finish(repair_journal(arguments->file, arguments->out), arguments->out);
  });
}

void add_trim(CLI::App& journal, const std::shared_ptr<JournalArguments>& arguments,
              Status& status) {
  CLI::App* action = add_journal_action(
      journal, "trim", "Write a range of observations, with their updates, to a new file.",
      R"(Example, observations 100 to 250 of every source:
  brainshift journal trim long.surgery --from 100 --to 250 --out part.surgery
The original is only read, and every record of it must be good.)");
  add_required(*action, "file", arguments->file, "surgery file (.surgery)");
  add_required(*action, "--from", arguments->first, "first sequence to keep");
  add_required(*action, "--to", arguments->last, "last sequence to keep");
  add_required(*action, "--out", arguments->out, "surgery file to make; must not exist");
  action->callback([arguments, &status] {
    status =
        finish(trim_journal(arguments->file, arguments->first, arguments->last, arguments->out),
               arguments->out);
  });
}

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
    return invalid("--sequence: \"" + text + "\": must be the number of an update, or last");
  }
  choice.sequence = number;
  return {};
}

Status read_direction(const std::string& text, ExportOptions& options) {
  if (text.empty()) return {};  // export_surgery explains both
  options.direction = io::field_direction(text);
  if (options.direction) return {};
  return invalid("--direction: \"" + text + "\": must be resampling or modeling");
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
    "              plastimatch), on the grid of the deformed brain. For 3D Slicer always this "
    "one,\n"
    "              for images and models: it takes the files for from-parent and inverts them\n"
    "  modeling    x + v(x) is where the undeformed point x goes: moves points and models; not "
    "for\n"
    "              3D Slicer, which before 5.10 takes such a file for resampling\n"
    "Formats, --formats A,B: nifti-1007 nifti-1006 nrrd itk sd known jacobian surfaces; series\n"
    "(every usable field, .vtu and .pvd, as journal export --vtu) on request; all.\n"
    "Examples:\n"
    "  The last usable field of a journal, and the MRI as the brain looks now, on the MRI's grid:\n"
    "    brainshift export journal/colin27-20250131T120000Z-1.surgery --model colin27.h5 \\\n"
    "      --direction resampling --like mri.nii.gz --image mri.nii.gz --out exported\n"
    "    antsApplyTransforms -d 3 -i mri.nii.gz -r mri.nii.gz -t exported/displacement-1007.nii.gz "
    "-o w.nii.gz\n"
    "  Update 12 for 3D Slicer, 1 mm:\n"
    "    brainshift export a.surgery --model colin27.h5 --sequence 12 --direction resampling \\\n"
    "      --spacing-mm 1 --formats nrrd,surfaces --out for-slicer\n"
    "export.json says of every file its direction, frame, units, update and quality. The folder\n"
    "must not exist, or be empty; it appears whole or not at all. A simulated or imported surgery\n"
    "holds no field: replay it to a daemon that keeps a journal (docs/export.md).";

}  // namespace

void add_journal(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<JournalArguments>();
  CLI::App* journal = app.add_subcommand(
      "journal", "Check, export, repair and trim recorded surgeries (docs/journal.md).");
  journal->require_subcommand(1);
  journal->footer(
      R"(Examples:
  brainshift journal check journal/*.surgery
  brainshift journal export paper.surgery --csv paper.csv
  brainshift journal repair damaged.surgery --out mended.surgery
  brainshift journal trim long.surgery --from 100 --to 250 --out part.surgery
Each has a --help of its own.)");
  add_check(*journal, arguments, status);
  add_export(*journal, arguments, status);
  add_repair(*journal, arguments, status);
  add_trim(*journal, arguments, status);
}

void add_export(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand(
      "export", "Write a field of a journal for 3D Slicer, ITK, ANTs, elastix, ParaView.");
  ExportOptions& options = arguments->options;
  add_required(*command, "file", options.surgery, "surgery file with updates (a journal)");
  add_required(*command, "--model", options.model, "prepared model (.h5) it was recorded with");
  add_required(*command, "--out", options.out, "folder to make; must not exist or be empty");
  command->add_option("--direction", arguments->direction,
                      "resampling or modeling; required, never implied");
  add_with_default(*command, "--sequence", arguments->sequence,
                   "number of an update, or last (usable)");
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
