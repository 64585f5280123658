// SPDX-License-Identifier: GPL-3.0-or-later
// What leaving out parts of a scene saves and costs on the default head, for
// every scenario of the twin without ICP: the time of updates with and without
// a part, the true difference between them, and the inverter's own estimate of
// that difference.
//   build/release/bin/bench_scenes [--case CASE] [--csv FILE]
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "client/tools/twin/surgery.hpp"
#include "common/core/statistics.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "common/linalg/openblas.hpp"
#include "common/patient/read_patient.hpp"
#include "common/pipeline/scene.hpp"
#include "tests/benchmarks/tools.hpp"

namespace brainshift {
namespace {

using bench::value_or_exit;

SparseData data_of(const LandmarkPairs& pairs, double sigma_mm) {
  return {pairs.undeformed, pairs.deformed - pairs.undeformed,
          VecX::Constant(pairs.undeformed.cols(), sigma_mm)};
}

struct Part {
  const char* name;
  inversion::CondensedOptions options;
  double inversion::OmissionErrors::*error;  // null: displacements do not change
};

struct Measured {
  std::vector<double> invert_ms, rebuild_ms;
  void add(inversion::CondensedInverter& inverter, const SparseData& data, Estimate& estimate) {
    for (int i = 0; i < 5; ++i) {  // the first is cold, the others start from its contact set
      if (auto status = inverter.update(data, estimate); !status) {
        std::fprintf(stderr, "%s\n", status.error().message.c_str());
        std::exit(1);
      }
      if (i == 0) continue;
      invert_ms.push_back(estimate.history.back().elapsed_ms);
      rebuild_ms.push_back(estimate.rebuild_ms);
    }
  }
};

void run(const std::string& case_file, const std::string& csv_file) {
  auto [config, brain] = value_or_exit(patient::read_patient(case_file));
  const auto model = std::make_shared<const BrainModel>(std::move(brain));
  const auto prepared =
      value_or_exit(inversion::PreparedModel::prepare(model, config, Boundary::kContact));
  const auto operators =
      std::make_shared<const CondensedOperators>(value_or_exit(inversion::condense(prepared)));
  const auto locator = std::make_shared<const geometry::TetLocator>(model->mesh);

  std::vector<Part> parts(5);
  parts[0] = {"everything", {}, nullptr};
  parts[1] = {"contact", {}, &inversion::OmissionErrors::contact_mm};
  parts[1].options.contact = false;
  parts[2] = {"uncertainty", {}, nullptr};
  parts[2].options.uncertainty = false;
  parts[3] = {"gravity_modes", {}, &inversion::OmissionErrors::gravity_modes_mm};
  parts[3].options.gravity_modes = false;
  parts[4] = {"far_field", {}, &inversion::OmissionErrors::far_field_mm};
  parts[4].options.region_of_interest =
      pipeline::region_of_interest(*model, config.scene.region_of_interest_mm);
  std::printf("%d nodes, %d slaves, %zu nodes within %.0f mm of the tumour\n",
              operators->num_nodes(), operators->num_slaves(),
              parts[4].options.region_of_interest.size(), config.scene.region_of_interest_mm);
  std::vector<inversion::CondensedInverter> inverters;
  for (const Part& part : parts) {
    inverters.push_back(value_or_exit(
        inversion::CondensedInverter::build(operators, locator, config, part.options)));
  }
  std::ofstream csv;
  if (!csv_file.empty()) csv.open(csv_file);
  csv << "scenario,left_out,active,largest_mm,difference_mm,estimate_mm,invert_ms,rebuild_ms\n";
  std::printf("%-13s%-14s%8s%9s%11s%12s%11s%11s\n", "scenario", "left out", "active", "max mm",
              "diff mm", "estimate mm", "invert ms", "rebuild ms");
  for (const char* name : {"paper", "no-contact", "distension", "sag-progress"}) {
    const auto surgery =
        value_or_exit(client::play_scenario(*model, config, *client::find_scenario(name), 1));
    const std::size_t step = std::max<std::size_t>(1, surgery.observations.size() / 3);
    for (std::size_t o = 0; o < surgery.observations.size(); o += step) {
      const SparseData data =
          data_of(std::get<LandmarkPairs>(surgery.observations[o].body), config.inversion.sigma_mm);
      Estimate full, estimate;
      for (std::size_t p = 0; p < parts.size(); ++p) {
        Measured measured;
        measured.add(inverters[p], data, estimate);
        if (p == 0) full = estimate;
        const auto& error = parts[p].error;
        const double largest_mm = estimate.displacement.colwise().norm().maxCoeff();
        const double difference_mm =
            (estimate.displacement - full.displacement).colwise().norm().maxCoeff();
        const double estimate_mm = error != nullptr ? inverters[p].omission_errors().*error : 0.0;
        const double invert_ms = percentile(measured.invert_ms, 50);
        const double rebuild_ms = percentile(measured.rebuild_ms, 50);
        std::printf("%-13s%-14s%8d%9.3f%11.4f%12.4f%11.2f%11.2f\n", name, parts[p].name,
                    estimate.contact.active, largest_mm, difference_mm, estimate_mm, invert_ms,
                    rebuild_ms);
        csv << name << ',' << parts[p].name << ',' << estimate.contact.active << ',' << largest_mm
            << ',' << difference_mm << ',' << estimate_mm << ',' << invert_ms << ',' << rebuild_ms
            << '\n';
      }
    }
  }
}

}  // namespace
}  // namespace brainshift

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  std::string case_file = BRAINSHIFT_DEFAULT_CASE, csv_file;
  CLI::App app("What leaving out parts of a scene saves and costs.", "bench_scenes");
  app.add_option("--case", case_file, "case file")->capture_default_str();
  app.add_option("--csv", csv_file, "file for a row per surgery and part");
  CLI11_PARSE(app, argc, argv);
  brainshift::run(case_file, csv_file);
  return 0;
}
