// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "client/cli/command.hpp"
#include "client/ultrasound/import.hpp"
#include "common/io/files/output_path.hpp"

namespace brainshift::client {
namespace {

Status run(const ImportOptions& options) {
  if (!options.out.empty()) {  // import_recording names what is missing
    if (Status ok = io::check_output_file("--out", options.out); !ok) return ok;
  }
  const auto report = import_recording(options, terminal_progress());
  if (!report) return tl::unexpected(report.error());
  for (const std::string& line : report_lines(*report)) std::printf("%s\n", line.c_str());
  return {};
}

}  // namespace

void add_import(CLI::App& app, Status& status) {
  auto options = std::make_shared<ImportOptions>();
  CLI::App* command = app.add_subcommand(
      "import", "Make a surgery file from a recording of tracked ultrasound (docs/import.md).");
  command->add_option("--recording", options->recording,
                      "sequence of images with transforms (.mha, .nrrd)");
  command->add_option(
      "--device", options->device,
      "PLUS device set (.xml) with ImageToProbe; not needed when the recording has it");
  command->add_option("--contours", options->contours,
                      "traced tumour contours: .csv frame,u_px,v_px or .json");
  command->add_option("--seeds", options->seeds,
                      "instead of contours: a point inside the tumour, .csv frame,u_px,v_px");
  command->add_option("--registration", options->registration,
                      "T_ras_reference: 16 numbers row by row (text, JSON or YAML)");
  command->add_option("--fiducials", options->fiducials,
                      "instead of --registration: .csv of paired points (reference x,y,z, RAS "
                      "x,y,z), or of reference,x,y,z and ras,x,y,z rows in any order");
  command->add_option("--case", options->case_file, "case file (YAML); its model is built again");
  command->add_option("--model", options->model, "instead of --case: prepared model (.h5)");
  command->add_option("--out", options->out, "surgery file to make; must not exist yet");
  command->add_option("--sd-mm", options->sd_mm, "standard deviation of a boundary point, mm")
      ->capture_default_str();
  command
      ->add_option("--latency-ms", options->latency_ms,
                   "how much later images were stamped than seen, ms; poses are interpolated")
      ->capture_default_str();
  command
      ->add_option("--max-age-ms", options->max_age_ms,
                   "poses are not interpolated across a longer gap, ms")
      ->capture_default_str();
  command
      ->add_option("--sweeps", options->sweep_gap_s,
                   "a new sweep begins after so many seconds without a contour; 0: one sweep")
      ->capture_default_str();
  command->add_flag("--open-contours", options->open_contours,
                    "contours of a .csv are open lines, not closed ones");
  command->add_option("--image", options->image_frame, "name of the images' frame")
      ->capture_default_str();
  command
      ->add_option("--reference", options->reference_frame, "name of the patient's reference frame")
      ->capture_default_str();
  command->add_option("--orientation", options->orientation,
                      "of the images (MF, MN, UF, UN) when the recording does not say");
  command->footer(
      "Example: a sweep recorded with PLUS, contours traced on its images, replayed to the "
      "daemon:\n"
      "  brainshift import --recording sweep.igs.mha --device device.xml --contours tumour.csv \\\n"
      "    --registration T_ras_reference.txt --model colin27.h5 --out sweep.surgery\n"
      "  brainshift replay sweep.surgery --endpoint tcp://127.0.0.1:5555 --report sweep.json\n"
      "Frames are left out where the tracker lost sight; the report counts them by reason.");
  command->callback([options, &status] { status = run(*options); });
}

}  // namespace brainshift::client
