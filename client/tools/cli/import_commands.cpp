// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <memory>

#include "client/tools/cli/command.hpp"
#include "client/tools/import/import.hpp"
#include "client/tools/import/import_landmarks.hpp"
#include "common/io/files/output_path.hpp"

namespace brainshift::client {
namespace {

// What the arguments say: a recording, or landmarks.
struct ImportArguments {
  ImportOptions options;
  std::filesystem::path landmarks, landmarks_moved;
};

// Options that landmarks have no use for, by the paths given.
Status check_landmarks_alone(const ImportArguments& arguments) {
  const ImportOptions& options = arguments.options;
  for (const auto& [name, path] :
       {std::pair{"--recording", options.recording}, std::pair{"--device", options.device},
        std::pair{"--contours", options.contours}, std::pair{"--seeds", options.seeds},
        std::pair{"--registration", options.registration},
        std::pair{"--fiducials", options.fiducials}}) {
    if (path.empty()) continue;
    return invalid(std::string(name) + " is for a recording: landmarks are in RAS already");
  }
  return {};
}

// Prints what was made, if it was.
template <typename Report>
Status print_report(const Result<Report>& report, const std::filesystem::path& out) {
  return report.map([&](const Report& made) {
    print_lines(report_lines(made));
    if (!out.empty()) print_wrote(out);
  });
}

Status run_landmarks(const ImportArguments& arguments) {
  if (Status ok = check_landmarks_alone(arguments); !ok) return ok;
  const ImportOptions& given = arguments.options;
  return print_report(import_landmarks({arguments.landmarks, arguments.landmarks_moved,
                                        given.case_file, given.model, given.out, given.sd_mm},
                                       terminal_progress()),
                      given.out);
}

Status run_import(const ImportArguments& arguments) {
  const ImportOptions& options = arguments.options;
  if (!options.out.empty()) {  // import_recording names what is missing
    if (Status ok = io::check_output_file("--out", options.out); !ok) return ok;
  }
  if (!arguments.landmarks.empty()) return run_landmarks(arguments);
  if (!arguments.landmarks_moved.empty()) return invalid("--landmarks-moved needs --landmarks");
  return print_report(import_recording(options, terminal_progress()), options.out);
}

}  // namespace

void add_import(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<ImportArguments>();
  ImportOptions* options = &arguments->options;
  CLI::App* command = app.add_subcommand("import",
                                         "Make a surgery file from a recording of tracked "
                                         "ultrasound, or from landmarks (docs/import.md).");
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
  command->add_option("--landmarks", arguments->landmarks,
                      "instead of --recording: landmarks before and during surgery, mm RAS (.csv, "
                      "MNI .tag), or those before (Slicer's .mrk.json or .fcsv, .csv)");
  command->add_option(
      "--landmarks-moved", arguments->landmarks_moved,
      "the landmarks during surgery where --landmarks has those before; paired by name");
  command->add_option("--case", options->case_file, "case file (YAML); its model is built again");
  command->add_option("--model", options->model, "instead of --case: prepared model (.h5)");
  command->add_option("--out", options->out, "surgery file to make; must not exist yet");
  add_with_default(*command, "--sd-mm", options->sd_mm,
                   "standard deviation of a boundary point or landmark, mm");
  add_with_default(*command, "--latency-ms", options->latency_ms,
                   "how much later images were stamped than seen, ms; poses are interpolated");
  add_with_default(*command, "--max-age-ms", options->max_age_ms,
                   "poses are not interpolated across a longer gap, ms");
  add_with_default(*command, "--sweeps", options->sweep_gap_s,
                   "a new sweep begins after so many seconds without a contour; 0: one sweep");
  command->add_flag("--open-contours", options->open_contours,
                    "contours of a .csv are open lines, not closed ones");
  add_with_default(*command, "--image", options->image_frame, "name of the images' frame");
  add_with_default(*command, "--reference", options->reference_frame,
                   "name of the patient's reference frame");
  command->add_option("--orientation", options->orientation,
                      "of the images (MF, MN, UF, UN) when the recording does not say");
  command->footer(
      R"(Example: a sweep recorded with PLUS, contours traced on its images, replayed to the daemon:
  brainshift import --recording sweep.igs.mha --device device.xml --contours tumour.csv \
    --registration T_ras_reference.txt --model colin27.h5 --out sweep.surgery
  brainshift replay sweep.surgery --endpoint tcp://127.0.0.1:5555 --report sweep.json
Landmarks of a brain before and during surgery, placed in 3D Slicer under the same names:
  brainshift import --landmarks before.mrk.json --landmarks-moved during.mrk.json \
    --model colin27.h5 --out landmarks.surgery
Frames are left out where the tracker lost sight; the report counts them by reason.)");
  command->callback([arguments, &status] { status = run_import(*arguments); });
}

}  // namespace brainshift::client
