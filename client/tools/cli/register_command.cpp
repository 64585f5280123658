// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "client/tools/cli/command.hpp"
#include "client/tools/import/register_patient.hpp"
#include "client/tools/import/register_ultrasound.hpp"
#include "common/io/files/output_path.hpp"

namespace brainshift::client {
namespace {

// What the arguments say: fiducials, or ultrasound. What both have is in `fiducials`.
struct RegisterArguments {
  RegisterOptions fiducials;
  UltrasoundRegisterOptions ultrasound;
  std::vector<double> target;
};

// Options that the other way of registering has no use for, where they were given.
Status check_alone(const CLI::App& command, const std::vector<std::string>& names,
                   const std::string& what) {
  for (const std::string& name : names) {
    if (command.get_option(name)->count() > 0) return invalid(name + " is for " + what);
  }
  return {};
}

Status run_register_ultrasound(const RegisterArguments& arguments) {
  const RegisterOptions& shared = arguments.fiducials;
  UltrasoundRegisterOptions options = arguments.ultrasound;
  options.device = shared.device, options.case_file = shared.case_file;
  options.model = shared.model, options.target = shared.target, options.out = shared.out;
  options.reference_frame = shared.reference_frame;
  if (!options.picture.empty()) {
    if (Status ok = io::check_output_file("--picture", options.picture); !ok) return ok;
  }
  return register_ultrasound(options, terminal_progress())
      .map([&](const UltrasoundRegisterReport& made) {
        print_lines(report_lines(made));
        print_wrote(options.out, ", look at " + made.picture.string());
      });
}

Status run_register(const CLI::App& command, RegisterArguments arguments) {
  RegisterOptions& options = arguments.fiducials;
  if (!arguments.target.empty()) {
    options.target = Vec3(arguments.target[0], arguments.target[1], arguments.target[2]);
  }
  if (!options.out.empty()) {  // what registers names what is missing
    if (Status ok = io::check_output_file("--out", options.out); !ok) return ok;
  }
  if (!arguments.ultrasound.ultrasound.empty()) {
    const Status alone = check_alone(
        command,
        {"--recording", "--fiducials", "--ras", "--pair", "--holds", "--still-mm", "--still-s",
         "--stylus"},
        "fiducials: with --ultrasound, --registration has the registration that they gave");
    return alone ? run_register_ultrasound(arguments) : alone;
  }
  const Status alone = check_alone(command,
                                   {"--mri", "--brain", "--registration", "--picture", "--image",
                                    "--orientation", "--latency-ms", "--max-age-ms"},
                                   "--ultrasound");
  if (!alone) return alone;
  return register_patient(options, terminal_progress()).map([&](const RegisterReport& made) {
    print_lines(report_lines(made));
    print_wrote(options.out);
  });
}

void add_shared(CLI::App& command, RegisterArguments& arguments) {
  RegisterOptions& options = arguments.fiducials;
  command.add_option("--device", options.device,
                     "PLUS device set (.xml) with StylusTipToStylus, or with ImageToProbe for "
                     "ultrasound; not needed when the recording has it");
  command.add_option(
      "--model", options.model,
      "prepared model (.h5): the expected error is reported at its tumour; its brain counts");
  command.add_option("--case", options.case_file,
                     "instead of --model: case file (YAML); its model is built again");
  command.add_option("--target", arguments.target, "instead of --model: a point, mm RAS")
      ->expected(3)
      ->type_name("X Y Z");
  command.add_option(
      "--out", options.out,
      "T_ras_reference as `brainshift import --registration` reads it; must not exist yet");
  add_with_default(command, "--reference", options.reference_frame,
                   "name of the patient's reference frame");
}

void add_fiducials(CLI::App& command, RegisterArguments& arguments) {
  RegisterOptions& options = arguments.fiducials;
  const char* const group = "From fiducials";
  command
      .add_option("--recording", options.recording,
                  "tracked stylus held still on each fiducial, as PLUS records it (.mha, .nrrd; "
                  "images are not needed)")
      ->group(group);
  command
      .add_option("--fiducials", options.fiducials,
                  "instead of --recording: .csv of the points touched, x,y,z or name,x,y,z in the "
                  "reference frame; or pairs as `brainshift import` reads them")
      ->group(group);
  command
      .add_option("--ras", options.ras,
                  "the fiducials in the image: Slicer's .mrk.json or .fcsv, or .csv in mm RAS")
      ->group(group);
  const std::map<std::string, Pairing> pairings = {{"auto", Pairing::kAuto},
                                                   {"name", Pairing::kName},
                                                   {"order", Pairing::kOrder},
                                                   {"shape", Pairing::kShape}};
  command
      .add_option("--pair", options.pairing,
                  "how both lists are paired: by name, in order, or by shape (distances between "
                  "the fiducials); auto: by name where both have names, else in order")
      ->transform(CLI::CheckedTransformer(pairings))
      ->default_str("auto")
      ->group(group);
  command
      .add_option("--holds", options.holds,
                  "which holds of the stylus are fiducials, e.g. 1,2,4; default all")
      ->delimiter(',')
      ->group(group);
  add_with_default(command, "--still-mm", options.hold.radius_mm,
                   "held still: the tip stays within so many mm of its mean ...")
      ->group(group);
  add_with_default(command, "--still-s", options.hold.least_s, "... for at least so many seconds")
      ->group(group);
  add_with_default(command, "--stylus", options.tip_frame, "name of the frame of the stylus's tip")
      ->group(group);
}

void add_ultrasound(CLI::App& command, RegisterArguments& arguments) {
  UltrasoundRegisterOptions& options = arguments.ultrasound;
  const char* const group = "From ultrasound, before the dura is opened";
  command
      .add_option(
          "--ultrasound", options.ultrasound,
          "tracked ultrasound of the brain, as PLUS records it (.mha, .nrrd): sweeps across "
          "the tumour, best two that cross")
      ->group(group);
  command
      .add_option("--registration", options.registration,
                  "the first T_ras_reference, from fiducials: the search begins there")
      ->group(group);
  command.add_option("--mri", options.mri, "T1 MRI (NIfTI, NRRD, .mgz)")->group(group);
  command
      .add_option("--brain", options.brain,
                  "the brain's mask; default: the brain of --model or --case")
      ->group(group);
  command
      .add_option("--picture", options.picture,
                  "PNG of both before and after; default: beside --out, of the same name")
      ->group(group);
  add_with_default(command, "--image", options.image_frame, "name of the images' frame")
      ->group(group);
  command
      .add_option("--orientation", options.orientation,
                  "of the images (MF, MN, UF, UN) when the recording does not say")
      ->group(group);
  add_with_default(command, "--latency-ms", options.latency_ms,
                   "how much later images were stamped than seen, ms; poses are interpolated")
      ->group(group);
  add_with_default(command, "--max-age-ms", options.max_age_ms,
                   "poses are not interpolated across a longer gap, ms")
      ->group(group);
}

}  // namespace

void add_register(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<RegisterArguments>();
  CLI::App* command = app.add_subcommand(
      "register",
      "Make the patient registration from fiducials touched with a tracked stylus, and correct it "
      "by tracked ultrasound before the dura is opened (docs/register.md).");
  add_shared(*command, *arguments);
  add_fiducials(*command, *arguments);
  add_ultrasound(*command, *arguments);
  command->footer(
      "Example: four fiducials placed in 3D Slicer, touched in the same order while PLUS records:\n"
      "  brainshift register --recording stylus.igs.mha --device device.xml --ras "
      "fiducials.mrk.json \\\n"
      "    --model colin27.h5 --out T_ras_reference.txt\n"
      "Read the expected error at the tumour, not the registration error: a small one of few "
      "fiducials proves nothing.\n"
      "Hold the tip in each fiducial for two seconds, and move on quickly.\n"
      "Then, with the dura still closed, two sweeps that cross over the tumour correct it:\n"
      "  brainshift register --ultrasound dura.igs.mha --device device.xml --mri t1.nii.gz \\\n"
      "    --registration T_ras_reference.txt --model colin27.h5 --out T_ras_reference_us.txt\n"
      "  brainshift import --recording sweep.igs.mha --device device.xml --contours tumour.csv \\\n"
      "    --registration T_ras_reference_us.txt --model colin27.h5 --out sweep.surgery\n"
      "Look at the picture: sulci, ventricles and tumour of both must lie on each other. It is "
      "refused, and nothing is\n"
      "written, where the ultrasound shows too little or the starts of the search disagree.");
  command->callback([arguments, command, &status] { status = run_register(*command, *arguments); });
}

}  // namespace brainshift::client
