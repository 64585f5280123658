// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "client/tools/cli/command.hpp"
#include "client/tools/init/init.hpp"

namespace brainshift::client {
namespace {

Status run_init(const InitOptions& options) {
  const auto summary = write_first_case(options);
  if (!summary) return tl::unexpected(summary.error());
  print_lines(summary->guesses);
  for (const auto& file : summary->files) print_wrote(file);
  std::printf("look at it: brainshift preview --case %s --out preview\n", options.out.c_str());
  return {};
}

}  // namespace

void add_init(CLI::App& app, Status& status) {
  auto options = std::make_shared<InitOptions>();
  CLI::App* command = app.add_subcommand(
      "init", "Write a first case file of a patient: guesses, each with where it comes from.");
  command->add_option("--mri", options->mri,
                      "T1 MRI (NIfTI, NRRD, .mgz), or a folder with one DICOM series");
  command->add_option("--labels", options->labels,
                      "label map by FreeSurfer's numbers (aseg.mgz, of SynthSeg), or by the names "
                      "of a *_dseg.tsv beside it: brain and brainstem are taken from it");
  command->add_option("--brain", options->brain, "brain mask or skull-stripped MRI");
  command->add_option("--tumour", options->tumour,
                      "segmentation (NIfTI, .mgz, .nrrd, .seg.nrrd, DICOM SEG or RTSTRUCT)");
  command->add_option("--tumour-label", options->tumour_label,
                      "the tumour's labels, where there are several: numbers or names of a "
                      "*_dseg.tsv beside it (of DICOM's segments or structures), between commas");
  command->add_option("--tumour-segment", options->tumour_segment,
                      "the tumour's segment in a .seg.nrrd");
  command->add_option(
      "--position", options->position,
      "how the patient will lie: supine, prone, sitting, left-lateral or "
      "right-lateral, then what differs: left-30 (face turned to the left), right-, "
      "flexed-, extended-, tilted-left-, tilted-right-, and of the table raised-, "
      "lowered-DEGREES");
  command->add_option("--out", options->out, "case file to write; must not exist yet");
  command->footer(
      "Example:\n"
      "  brainshift init --mri t1.nii.gz --labels synthseg.nii.gz --tumour tumour.nii.gz "
      "--position supine,left-30,raised-15 --out case.yaml\n"
      "  brainshift preview --case case.yaml --out preview\n"
      "Every guess is marked so in the case and printed: look at the pictures and correct it "
      "(docs/your-patient.md).");
  command->callback([options, &status] { status = run_init(*options); });
}

}  // namespace brainshift::client
