// SPDX-License-Identifier: GPL-3.0-or-later
// evidence_landmarks: landmarks of a real operation, leave-one-out (landmark_study.hpp), with the
// standard deviation that `brainshift import --landmarks` gives a landmark. Writes a row per
// landmark.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>
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
};

constexpr const char* kHeading =
    "landmark,none_mm,rigid_mm,affine_mm,thin_plate_mm,estimate_mm,estimated_motion_mm,quality";

Status write(const std::vector<LeftOutLandmark>& landmarks, const fs::path& out) {
  auto file = bench::CsvWriter::create(out, kHeading);
  if (!file) return tl::unexpected(file.error());
  for (const LeftOutLandmark& one : landmarks) {
    std::vector<std::string> cells = {one.name};
    for (const double value :
         {one.none, one.rigid, one.affine, one.thin_plate, one.estimate, one.motion_mm}) {
      cells.push_back(bench::csv_number(value));
    }
    cells.push_back(one.quality);
    if (Status ok = file->row(cells); !ok) return ok;
  }
  return {};
}

Status run(const Arguments& arguments) {
  const auto pairs = io::read_pairs(arguments.pairs);
  if (!pairs) return tl::unexpected(pairs.error());
  const auto config = surgeries::read_head(arguments.case_file);
  if (!config) return tl::unexpected(config.error());
  const bench::MeshWish wish{config->case_id, arguments.thousand_nodes};
  const auto head = bench::make_head(*config, wish);
  if (!head) return tl::unexpected(head.error());
  const Stopwatch watch;
  const auto landmarks = leave_one_out(*head, *pairs, client::LandmarkOptions{}.sd_mm);
  if (!landmarks) return tl::unexpected(landmarks.error());
  std::fprintf(stderr, "  %.1f s\n", watch.seconds());
  return write(*landmarks, arguments.out);
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
  app.add_option("--out", arguments.out, "table to write")->capture_default_str();
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::evidence::run(arguments); });
}
