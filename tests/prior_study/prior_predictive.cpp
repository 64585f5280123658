// SPDX-License-Identifier: GPL-3.0-or-later
// prior_predictive: draws brains from the force prior of method condensed, with the defaults, and
// compares their motion with what surgeons have measured (prior_targets.hpp).
//
// Writes into OUT: quantiles.csv and pictures; with $BRAINSHIFT_STUDY_DIR, the checks too
// (tests/support/study_record.hpp). Whether they hold is for study_summary to say.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/statistics.hpp"
#include "common/io/config/config_file.hpp"
#include "common/linalg/blas_kernel.hpp"
#include "tests/prior_study/prior_draws.hpp"
#include "tests/prior_study/prior_pictures.hpp"
#include "tests/prior_study/prior_table.hpp"
#include "tests/support/study_record.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::prior_study {
namespace {

struct Arguments {
  std::filesystem::path head = BRAINSHIFT_DEFAULT_CASE;
  std::filesystem::path targets = BRAINSHIFT_PRIOR_TARGETS;
  double thousand_nodes = 18.0;
  int draws = 500;
  std::uint64_t seed = 1;
  std::vector<std::string> strengths;  // of parts, where they are not as in the case
  std::filesystem::path out = ".";
};

void print(const std::vector<PartDraws>& all) {
  std::printf("%-16s%-10s%6s %8s %8s %8s %8s %8s   mm\n", "part", "place", "draws", "5 %", "25 %",
              "50 %", "75 %", "95 %");
  for (const PartDraws& part : all) {
    for (std::size_t p = 0; p < kPlaces; ++p) {
      std::printf("%-16s%-10s%6zu", part.part.c_str(), kPlaceNames[p], part.motion_mm[p].size());
      for (const double q : kQuantiles) std::printf(" %8.3f", percentile(part.motion_mm[p], q));
      std::printf("\n");
    }
  }
}

Status run(const Arguments& arguments) {
  const auto targets = read_targets(arguments.targets);
  if (!targets) return tl::unexpected(targets.error());
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
  print(*all);
  if (Status ok = write_quantiles(arguments.out / "quantiles.csv", *all, *targets); !ok) return ok;
  if (Status ok = draw_pictures(*all, *targets, arguments.out); !ok) return ok;
  check_quantiles(*all, *targets);
  record_figures(all->front());
  const auto left_out = left_out_sd_mm(*head->operators, places_of(*head->model, *head->locator));
  for (std::size_t p = 0; p < kPlaces; ++p) {
    test_support::record_figure("prior-predictive",
                                std::string(kPlaceNames[p]) + " left out by truncation mm",
                                left_out[p], "sd per component; not drawn", "");
  }
  return {};
}

}  // namespace
}  // namespace brainshift::prior_study

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::prior_study::Arguments arguments;
  CLI::App app{"Motion of brains drawn from the prior, against published ranges of brain shift.",
               "prior_predictive"};
  app.add_option("--head", arguments.head, "case file of the head")->capture_default_str();
  app.add_option("--targets", arguments.targets, "table of published quantiles")
      ->capture_default_str();
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
  app.add_option("--out", arguments.out, "folder of table and pictures")->capture_default_str();
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::prior_study::run(arguments); });
}
