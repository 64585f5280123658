// SPDX-License-Identifier: GPL-3.0-or-later
// evidence_landmarks: landmarks of a real operation, leave-one-out (landmark_study.hpp), with the
// standard deviation that `brainshift import --landmarks` gives a landmark. Writes a row per
// landmark; checks and a picture go to $BRAINSHIFT_STUDY_DIR (tests/support/study_record.hpp).
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "client/tools/import/import_landmarks.hpp"
#include "common/core/stopwatch.hpp"
#include "common/io/landmarks/pair_file.hpp"
#include "common/linalg/blas_kernel.hpp"
#include "tests/benchmarks/paired_test.hpp"
#include "tests/evidence/landmark_study.hpp"
#include "tests/support/study_record.hpp"
#include "tests/surgeries/dot_chart.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::evidence {
namespace {

namespace fs = std::filesystem;
namespace palette = client::palette;

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

struct Method {
  const char* name;
  double LeftOutLandmark::*distance;
  cv::Scalar colour;
  client::Marker marker;
  bool bound;  // the estimate must be nearer
};

const std::vector<Method>& methods() {
  static const std::vector<Method> all = {
      {"no correction", &LeftOutLandmark::none, palette::kGrey, client::Marker::kSquare, false},
      {"rigid", &LeftOutLandmark::rigid, palette::kBlue, client::Marker::kCircle, true},
      {"affine", &LeftOutLandmark::affine, palette::kGreen, client::Marker::kSquare, false},
      {"thin-plate spline", &LeftOutLandmark::thin_plate, palette::kVermillion,
       client::Marker::kTriangle, true},
      {"estimate", &LeftOutLandmark::estimate, palette::kInk, client::Marker::kCircle, false}};
  return all;
}

void check(const std::vector<LeftOutLandmark>& landmarks, const std::string& study) {
  const std::string source =
      "leave-one-out over " + std::to_string(landmarks.size()) + " landmarks; evidence_landmarks";
  const double estimate = rms_of(landmarks, &LeftOutLandmark::estimate);
  const auto column = [&](double LeftOutLandmark::*distance) {
    std::vector<double> values;
    for (const LeftOutLandmark& one : landmarks) values.push_back(one.*distance);
    return values;
  };
  for (const Method& method : methods()) {
    const double rms = rms_of(landmarks, method.distance);
    test_support::record_figure(study, std::string("rms distance of ") + method.name + " mm", rms,
                                "shown", source);
    if (!method.bound) continue;
    const bench::PairedTest test =
        bench::paired_t_test(column(&LeftOutLandmark::estimate), column(method.distance));
    test_support::record_check(study, std::string("rms distance: estimate over ") + method.name,
                               estimate / rms, "< 1", estimate < rms, source);
    test_support::record_figure(study, std::string("p of a paired t test against ") + method.name,
                                test.p, "shown", source);
  }
}

Status draw(const std::vector<LeftOutLandmark>& landmarks, const fs::path& file) {
  client::ChartSpec spec;
  spec.title = "Landmarks foretold from the others";
  spec.subtitle = "each landmark left out once";
  spec.x.label = "landmark";
  spec.x.from_zero = false;
  for (const LeftOutLandmark& one : landmarks) spec.x.names.push_back(one.name);
  spec.y.label = "distance from where it was found (mm)";
  for (const Method& method : methods()) {
    client::Series series;
    series.legend = method.name;
    series.colour = method.colour;
    series.marker = method.marker;
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
      series.points.push_back({static_cast<double>(i), landmarks[i].*method.distance, ""});
    }
    spec.series.push_back(series);
  }
  return surgeries::write_chart(spec, file);
}

Status run(const Arguments& arguments) {
  const auto pairs = io::read_pairs(arguments.pairs);
  if (!pairs) return tl::unexpected(pairs.error());
  const auto config = surgeries::read_head(arguments.case_file);
  if (!config) return tl::unexpected(config.error());
  bench::MeshWish wish;
  wish.name = config->case_id;
  wish.thousand_nodes = arguments.thousand_nodes;
  const auto head = bench::make_head(*config, wish);
  if (!head) return tl::unexpected(head.error());
  const Stopwatch watch;
  const auto landmarks = leave_one_out(*head, *pairs, client::LandmarkOptions{}.sd_mm);
  if (!landmarks) return tl::unexpected(landmarks.error());
  for (const Method& method : methods()) {
    std::fprintf(stderr, "  %-18s %.3f mm rms\n", method.name, rms_of(*landmarks, method.distance));
  }
  std::fprintf(stderr, "  %.1f s\n", watch.seconds());
  if (Status ok = write(*landmarks, arguments.out); !ok) return ok;
  check(*landmarks, config->case_id);
  const char* folder = std::getenv("BRAINSHIFT_STUDY_DIR");
  if (folder == nullptr) return {};
  return draw(*landmarks, fs::path(folder) / "evidence-landmarks.png");
}

}  // namespace
}  // namespace brainshift::evidence

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::evidence::Arguments arguments;
  CLI::App app{"Landmarks of a real operation, each foretold from the others: a row per landmark.",
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
