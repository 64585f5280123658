// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <memory>
#include <vector>

#include "client/tools/cli/command.hpp"
#include "client/tools/import/register_patient.hpp"
#include "common/io/files/output_path.hpp"

namespace brainshift::client {
namespace {

// What the arguments say, before they are options of register_patient.
struct RegisterArguments {
  RegisterOptions options;
  std::vector<double> target;
};

Status run_register(const RegisterArguments& arguments) {
  RegisterOptions options = arguments.options;
  if (!arguments.target.empty()) {
    options.target = Vec3(arguments.target[0], arguments.target[1], arguments.target[2]);
  }
  if (!options.out.empty()) {  // register_patient names what is missing
    if (Status ok = io::check_output_file("--out", options.out); !ok) return ok;
  }
  const auto report = register_patient(options, terminal_progress());
  if (!report) return tl::unexpected(report.error());
  for (const std::string& line : report_lines(*report)) std::printf("%s\n", line.c_str());
  return {};
}

void add_inputs(CLI::App& command, RegisterArguments& arguments) {
  RegisterOptions& options = arguments.options;
  command.add_option("--recording", options.recording,
                     "tracked stylus held still on each fiducial, as PLUS records it (.mha, .nrrd; "
                     "images are not needed)");
  command.add_option("--device", options.device,
                     "PLUS device set (.xml) with StylusTipToStylus; not needed when the recording "
                     "has the tip");
  command.add_option("--fiducials", options.fiducials,
                     "instead of --recording: .csv of the points touched, x,y,z or name,x,y,z in "
                     "the reference frame; or pairs as `brainshift import` reads them");
  command.add_option("--ras", options.ras,
                     "the fiducials in the image: Slicer's .mrk.json or .fcsv, or .csv in mm RAS");
  command.add_option("--model", options.model,
                     "prepared model (.h5): the expected error is reported at its tumour");
  command.add_option("--case", options.case_file,
                     "instead of --model: case file (YAML); its model is built again");
  command.add_option("--target", arguments.target, "instead of --model: a point, mm RAS")
      ->expected(3)
      ->type_name("X Y Z");
  command.add_option("--out", options.out,
                     "T_ras_reference as `brainshift import --registration` reads it; must not "
                     "exist yet");
}

}  // namespace

void add_register(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<RegisterArguments>();
  RegisterOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand(
      "register",
      "Make the patient registration from fiducials touched with a tracked stylus "
      "(docs/register.md).");
  add_inputs(*command, *arguments);
  const std::map<std::string, Pairing> pairings = {{"auto", Pairing::kAuto},
                                                   {"name", Pairing::kName},
                                                   {"order", Pairing::kOrder},
                                                   {"shape", Pairing::kShape}};
  command
      ->add_option("--pair", options.pairing,
                   "how both lists are paired: by name, in order, or by shape (distances between "
                   "the fiducials); auto: by name where both have names, else in order")
      ->transform(CLI::CheckedTransformer(pairings))
      ->default_str("auto");
  command
      ->add_option("--holds", options.holds,
                   "which holds of the stylus are fiducials, e.g. 1,2,4; default all")
      ->delimiter(',');
  command
      ->add_option("--still-mm", options.hold.radius_mm,
                   "held still: the tip stays within so many mm of its mean ...")
      ->capture_default_str();
  command->add_option("--still-s", options.hold.least_s, "... for at least so many seconds")
      ->capture_default_str();
  command->add_option("--stylus", options.tip_frame, "name of the frame of the stylus's tip")
      ->capture_default_str();
  command
      ->add_option("--reference", options.reference_frame, "name of the patient's reference frame")
      ->capture_default_str();
  command->footer(
      "Example: four fiducials placed in 3D Slicer, touched in the same order while PLUS records:\n"
      "  brainshift register --recording stylus.igs.mha --device device.xml --ras "
      "fiducials.mrk.json "
      "\\\n"
      "    --model colin27.h5 --out T_ras_reference.txt\n"
      "  brainshift import --recording sweep.igs.mha --device device.xml --contours tumour.csv \\\n"
      "    --registration T_ras_reference.txt --model colin27.h5 --out sweep.surgery\n"
      "Read the expected error at the tumour, not the registration error: a small one of few "
      "fiducials proves nothing.\n"
      "Hold the tip in each fiducial for two seconds, and move on quickly.");
  command->callback([arguments, &status] { status = run_register(*arguments); });
}

}  // namespace brainshift::client
