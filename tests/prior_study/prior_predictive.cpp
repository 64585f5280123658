// SPDX-License-Identifier: GPL-3.0-or-later
// prior_predictive: draws brains from the force prior of method condensed, with the defaults.
// tests/studies/prior.py compares their motion with what surgeons have measured (targets.csv).
//
// Writes into OUT, numbers in full:
//   draws.csv        a row per part and brain: part,settled,cortex_mm,tumour_mm,far_side_mm,
//                    outward_mm,min_volume_ratio. Nothing else is known of a brain without a
//                    contact set (settled 0); min_volume_ratio is that of "total" alone
//   truncation.csv   place,left_out_sd_mm: what the modes leave out (prior_draws.hpp)
#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "common/io/config/config_file.hpp"
#include "common/linalg/openblas.hpp"
#include "tests/benchmarks/csv_table.hpp"
#include "tests/prior_study/prior_draws.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::prior_study {
namespace {

struct Arguments {
  std::filesystem::path head = BRAINSHIFT_DEFAULT_CASE;
  double thousand_nodes = 18.0;
  int draws = 500;
  std::uint64_t seed = 1;
  std::vector<std::string> strengths;  // of parts, where they are not as in the case
  std::filesystem::path out = ".";
};

std::string full(double value) { return bench::csv_number(value, 17); }

Status write_draws(const std::filesystem::path& file, const std::vector<PartDraws>& all) {
  auto csv = bench::CsvWriter::create(
      file, "part,settled,cortex_mm,tumour_mm,far_side_mm,outward_mm,min_volume_ratio");
  if (!csv) return tl::unexpected(csv.error());
  for (const PartDraws& draws : all) {
    const auto& [cortex, tumour, far_side] = draws.motion_mm;
    for (std::size_t i = 0; i < cortex.size(); ++i) {
      const bool has_ratio = i < draws.min_volume_ratio.size();
      if (Status ok = csv->row({draws.part, "1", full(cortex[i]), full(tumour[i]),
                                full(far_side[i]), full(draws.outward_mm[i]),
                                has_ratio ? full(draws.min_volume_ratio[i]) : ""});
          !ok) {
        return ok;
      }
    }
    for (int i = 0; i < draws.unsettled; ++i) {
      if (Status ok = csv->row({draws.part, "0", "", "", "", "", ""}); !ok) return ok;
    }
  }
  return {};
}

Status write_truncation(const std::filesystem::path& file, const bench::Head& head) {
  auto csv = bench::CsvWriter::create(file, "place,left_out_sd_mm");
  if (!csv) return tl::unexpected(csv.error());
  const auto left_out = left_out_sd_mm(*head.operators, places_of(*head.model, *head.locator));
  for (std::size_t p = 0; p < kPlaces; ++p) {
    if (Status ok = csv->row({kPlaceNames[p], full(left_out[p])}); !ok) return ok;
  }
  return {};
}

Status run(const Arguments& arguments) {
  if (!std::filesystem::is_directory(arguments.out)) {
    return fail(ErrorCode::kNotFound, arguments.out.string() + ": is no folder");
  }
  const auto strengths = parse_strengths(arguments.strengths);
  if (!strengths) return tl::unexpected(strengths.error());
  const auto config = io::read_case_config(arguments.head);
  if (!config) return tl::unexpected(config.error());
  const auto head = bench::make_head(*config, {config->case_id, arguments.thousand_nodes});
  if (!head) return tl::unexpected(head.error());
  const auto all = draw_prior(*head, arguments.draws, arguments.seed, *strengths);
  if (!all) return tl::unexpected(all.error());
  if (Status ok = write_draws(arguments.out / "draws.csv", *all); !ok) return ok;
  return write_truncation(arguments.out / "truncation.csv", *head);
}

}  // namespace
}  // namespace brainshift::prior_study

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::prior_study::Arguments arguments;
  CLI::App app{"Motion of brains drawn from the prior.", "prior_predictive"};
  app.add_option("--head", arguments.head, "case file of the head")->capture_default_str();
  app.add_option("--thousand-nodes", arguments.thousand_nodes,
                 "size of the mesh; 18: the case's own edge length")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1000.0));
  app.add_option("--draws", arguments.draws, "brains")
      ->capture_default_str()
      ->check(CLI::Range(20, 1000000));
  app.add_option("--seed", arguments.seed, "of the draws")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  app.add_option("--strength", arguments.strengths,
                 "PART=NUMBER, in units of the case's standard deviations: what if");
  app.add_option("--out", arguments.out, "folder of draws.csv and truncation.csv")
      ->capture_default_str();
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::prior_study::run(arguments); });
}
