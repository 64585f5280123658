// SPDX-License-Identifier: GPL-3.0-or-later
// evidence_landmarks: landmarks of a real operation, leave-one-out (landmark_study.hpp), with the
// standard deviation that `brainshift import --landmarks` gives a landmark unless --sd says
// otherwise. Writes a row per pose of the head and landmark.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "client/tools/import/import_landmarks.hpp"
#include "common/core/stopwatch.hpp"
#include "common/io/landmarks/pair_file.hpp"
#include "common/linalg/openblas.hpp"
#include "tests/benchmarks/csv_table.hpp"
#include "tests/evidence/landmark_study.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::evidence {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path pairs, case_file, out = "landmarks.csv";
  double thousand_nodes = 18.0;
  double sd_mm = client::LandmarkOptions{}.sd_mm;
};

constexpr const char* kHeading =
    "pose,landmark,none_mm,rigid_mm,affine_mm,thin_plate_mm,estimate_mm,estimated_motion_mm,sd_mm,"
    "inside_90,quality";

Status write(const std::string& pose, const std::vector<LeftOutLandmark>& landmarks,
             bench::CsvWriter& file) {
  for (const LeftOutLandmark& one : landmarks) {
    std::vector<std::string> cells = {pose, one.name};
    for (const double value : {one.none, one.rigid, one.affine, one.thin_plate, one.estimate,
                               one.motion_mm, one.sd_mm}) {
      cells.push_back(bench::csv_number(value));
    }
    cells.push_back(std::to_string(one.inside));
    cells.push_back(one.quality);
    if (Status ok = file.row(cells); !ok) return ok;
  }
  return {};
}

Status run(const Arguments& arguments) {
  const auto pairs = io::read_pairs(arguments.pairs);
  if (!pairs) return tl::unexpected(pairs.error());
  const auto config = surgeries::read_head(arguments.case_file);
  if (!config) return tl::unexpected(config.error());
  auto file = bench::CsvWriter::create(arguments.out, kHeading);
  if (!file) return tl::unexpected(file.error());
  const bench::MeshWish wish{config->case_id, arguments.thousand_nodes};
  for (const HeadPose& pose : head_poses(*config)) {
    const Stopwatch watch;
    CaseConfig posed = *config;
    posed.gravity_direction = pose.gravity;
    const auto head = bench::make_head(std::move(posed), wish);
    if (!head) return tl::unexpected(head.error());
    const auto landmarks = leave_one_out(*head, *pairs, arguments.sd_mm);
    if (!landmarks) return tl::unexpected(landmarks.error());
    std::fprintf(stderr, "  %s: %.1f s\n", pose.name.c_str(), watch.seconds());
    if (Status ok = write(pose.name, *landmarks, *file); !ok) return ok;
  }
  return {};
}

}  // namespace
}  // namespace brainshift::evidence

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::evidence::Arguments arguments;
  CLI::App app{"Landmarks of a real operation, each predicted from the others: a row per landmark.",
               "evidence_landmarks"};
  app.add_option("--pairs", arguments.pairs,
                 "landmarks before and during surgery, mm RAS (docs/import.md)")
      ->required();
  app.add_option("--case", arguments.case_file, "case file of a head in the landmarks' frame")
      ->required();
  app.add_option("--thousand-nodes", arguments.thousand_nodes,
                 "size of the mesh; 18: the case's own edge length")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1000.0));
  app.add_option("--sd", arguments.sd_mm, "standard deviation of a landmark, mm")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--out", arguments.out, "table to write")->capture_default_str();
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::evidence::run(arguments); });
}
