// SPDX-License-Identifier: GPL-3.0-or-later
// Error against run time of all inversion methods, over mesh sizes (error_time.hpp). Writes raw
// repetitions, which tests/studies/bench.py turns into figures, tables and checks.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "common/io/config/config_file.hpp"
#include "common/linalg/openblas.hpp"
#include "tests/benchmarks/error_time.hpp"

namespace brainshift::bench {
namespace {

// The largest meshes. Slow: the methods that take a minute per estimate at 18 thousand nodes.
// Iterative: the others.
constexpr double kSlowLimitThousandNodes = 20.0;
constexpr double kIterativeLimitThousandNodes = 50.0;
constexpr int kQuickRepetitions = 5;
struct Arguments {
  std::filesystem::path case_file = BRAINSHIFT_DEFAULT_CASE;
  std::vector<double> sizes = {5, 18, 40, 100};
  double local_factor = 1.0;
  std::vector<std::string> methods;
  std::vector<int> ranks = {16, 32, 64, CondensedConfig{}.max_rank};
  std::vector<std::string> scenarios = {"paper", "distension"};
  int repetitions = 20;
  int compared = 20;
  int timed = 3;
  std::uint64_t seed = 1;
  double memory_limit_gib = 22.0;
  double method_budget_s = 200.0;
  std::filesystem::path out = "out/bench";
  bool quick = false, all = false;
};

// The paper's method by Woodbury's formula gives the same estimates as the paper's own, in a third
// of the time; so it plays more surgeries of the first scenario, where errors are compared.
int repetitions_of(const Arguments& arguments, Method method, bool first_scenario) {
  if (!first_scenario) return 1;
  const int wanted = method == Method::kPaperWoodbury ? arguments.compared : arguments.timed;
  return std::min(wanted, arguments.repetitions);
}

bool has_papers_prior(Method method) {
  return method == Method::kPaper || method == Method::kPaperWoodbury;
}

double largest_mesh_thousand_nodes(Method method) {
  switch (method) {
    case Method::kCondensed: return std::numeric_limits<double>::infinity();
    case Method::kPaper:
    case Method::kIterativeSolver: return kSlowLimitThousandNodes;
    default: return kIterativeLimitThousandNodes;
  }
}

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const Method method : kAllMethods) names.emplace_back(to_string(method));
  return names;
}

Progress lines(const std::string& mesh) {
  return [mesh, last = std::string()](std::string_view stage, double) mutable {
    if (stage == last) return;
    last = stage;
    std::fprintf(stderr, "  %s: %s\n", mesh.c_str(), last.c_str());
  };
}

bool plays(const Arguments& arguments, Method method) {
  const std::string name(to_string(method));
  return std::find(arguments.methods.begin(), arguments.methods.end(), name) !=
         arguments.methods.end();
}

Status run_trial(const Arguments& arguments, const Head& head, const std::vector<Prior>& priors,
                 const Trial& trial, double thousand_nodes, CsvWriter& out) {
  for (const Method method : kAllMethods) {
    const std::string name(to_string(method));
    if (!plays(arguments, method)) continue;
    if (method == Method::kCondensed) {
      std::set<int> ranks;  // more modes than there are: all of them
      for (const int rank : arguments.ranks) {
        ranks.insert(std::min(rank, head.operators->num_modes()));
      }
      for (const int rank : ranks) {
        std::fprintf(stderr, "  %s %s: %s, %d modes\n", head.name.c_str(), trial.scenario.c_str(),
                     name.c_str(), rank);
        if (Status ok = run_condensed(head, trial, rank, out); !ok) return ok;
      }
      continue;
    }
    if (!arguments.all && thousand_nodes > largest_mesh_thousand_nodes(method)) continue;
    const bool first_scenario = trial.scenario == arguments.scenarios.front();
    const int repetitions = repetitions_of(arguments, method, first_scenario);
    for (const Prior& prior : priors) {
      const bool own = std::string(prior.name) == "paper";
      if (own && !(first_scenario && has_papers_prior(method))) continue;
      std::fprintf(stderr, "  %s %s: %s, prior of the %s\n", head.name.c_str(),
                   trial.scenario.c_str(), name.c_str(), prior.name);
      if (Status ok =
              run_method(head, trial, method, prior, repetitions, arguments.method_budget_s, out);
          !ok) {
        return ok;
      }
    }
  }
  return {};
}

Status run_mesh(const Arguments& arguments, CaseConfig config, const MeshWish& wish) {
  config.condensed.memory_limit_gib = arguments.memory_limit_gib;
  config.condensed.max_rank = *std::max_element(arguments.ranks.begin(), arguments.ranks.end());
  // The run times are measured, so no deadline may cut them.
  config.condensed.deadline_ms = 1e6;
  std::fprintf(stderr, "%s\n", wish.name.c_str());
  auto head = make_head(std::move(config), wish, lines(wish.name));
  if (!head) return tl::unexpected(head.error());
  const auto file = [&](const std::string& stem) {
    return arguments.out / (stem + "-" + wish.name + ".csv");
  };
  auto meshes = CsvWriter::create(file("meshes"), kMeshHeading);
  if (!meshes) return tl::unexpected(meshes.error());
  if (Status ok = meshes->row(mesh_row(*head)); !ok) return ok;
  std::vector<Prior> priors = {{"case", head->prepared}};
  if (std::any_of(std::begin(kAllMethods), std::end(kAllMethods), [&](Method method) {
        return has_papers_prior(method) && plays(arguments, method);
      })) {
    auto own = papers_prior(*head);
    if (!own) return tl::unexpected(own.error());
    priors.push_back(std::move(*own));
  }
  auto rows = CsvWriter::create(file("error_time"), kErrorTimeHeading);
  if (!rows) return tl::unexpected(rows.error());
  for (const std::string& name : arguments.scenarios) {
    auto trial = make_trial(*head, *client::find_scenario(name), arguments.repetitions,
                            arguments.seed, lines(wish.name + " " + name));
    if (!trial) return tl::unexpected(trial.error());
    if (Status ok = run_trial(arguments, *head, priors, *trial, wish.thousand_nodes, *rows); !ok)
      return ok;
  }
  return {};
}

Status run(Arguments arguments) {
  if (arguments.quick) arguments.repetitions = std::min(arguments.repetitions, kQuickRepetitions);
  std::sort(arguments.ranks.begin(), arguments.ranks.end());
  std::error_code error;
  std::filesystem::create_directories(arguments.out, error);
  if (error) return fail(ErrorCode::kWriteFailed, arguments.out.string() + ": " + error.message());
  const auto config = io::read_case_config(arguments.case_file);
  if (!config) return tl::unexpected(config.error());
  std::vector<MeshWish> wishes;
  const auto name = [](double size) { return csv_number(size) + "k"; };
  for (const double size : arguments.sizes) {
    const bool refined = arguments.local_factor != 1.0;
    wishes.push_back({name(size) + (refined ? "-refined" : ""), size, arguments.local_factor});
  }
  for (const MeshWish& wish : wishes) {
    if (Status ok = run_mesh(arguments, *config, wish); !ok) return ok;
  }
  return {};
}

void describe(CLI::App& app, Arguments& arguments) {
  const auto list = [](CLI::Option* option) { option->delimiter(',')->capture_default_str(); };
  app.add_option("--case", arguments.case_file, "case file; must generate its mesh")
      ->capture_default_str();
  list(app.add_option("--sizes", arguments.sizes, "mesh sizes, thousand nodes")
           ->check(CLI::Range(1.0, 500.0)));
  app.add_option("--local-factor", arguments.local_factor,
                 "edges at tumour and craniotomy in units of the edge elsewhere; other than 1, the "
                 "mesh is called SIZEk-refined")
      ->check(CLI::Range(0.1, 1.0))
      ->capture_default_str();
  arguments.methods = method_names();
  list(app.add_option("--methods", arguments.methods, "inversion methods")
           ->check(CLI::IsMember(method_names())));
  list(app.add_option("--ranks", arguments.ranks,
                      "prior modes of the condensed method; the largest is prepared")
           ->check(CLI::Range(1, 2000)));
  std::vector<std::string> scenarios;
  for (const client::Scenario& each : client::all_scenarios()) scenarios.push_back(each.name);
  list(app.add_option("--scenarios", arguments.scenarios, "simulated surgeries")
           ->check(CLI::IsMember(scenarios)));
  app.add_option("--repetitions", arguments.repetitions,
                 "surgeries per scenario, all of which condensed plays; others one of every "
                 "scenario but the first, as time allows")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--compared", arguments.compared,
                 "surgeries of the first scenario that paper-woodbury plays")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--timed", arguments.timed,
                 "surgeries of the first scenario that the other methods play")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--seed", arguments.seed, "of the first surgery; the next ones count on")
      ->capture_default_str();
  app.add_option("--memory-limit-gib", arguments.memory_limit_gib,
                 "refuse to prepare what needs more")
      ->check(CLI::Range(0.1, 10000.0))
      ->capture_default_str();
  app.add_option("--method-budget-s", arguments.method_budget_s,
                 "time per method and scenario; what takes longer is stopped")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  app.add_option("--out", arguments.out, "folder for error_time-MESH.csv and meshes-MESH.csv")
      ->capture_default_str();
  app.add_flag("--quick", arguments.quick, "at most 5 repetitions");
  app.add_flag("--all", arguments.all, "all methods on large meshes too");
  app.footer(
      "One mesh, the condensed method alone, half a minute of repetitions at most:\n"
      "  OMP_NUM_THREADS=1 bench_error_time --sizes 18 --methods condensed --scenarios paper --out "
      "/tmp/bench\n"
      "Then `PYTHONPATH=tests python3 -m studies bench --dir /tmp/bench --figures-only` draws it.\n"
      "Exit status: 0 success, 2 bad usage or bad input, 1 failure.");
}

}  // namespace
}  // namespace brainshift::bench

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  using namespace brainshift;
  CLI::App app{"Error against run time of all inversion methods on simulated surgeries.",
               "bench_error_time"};
  bench::Arguments arguments;
  bench::describe(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "bench_error_time: %s (see bench_error_time --help)\n", error.what());
    return 2;
  }
  linalg::use_single_threaded_blas();  // before the first factorisation
  const Status status = bench::run(std::move(arguments));
  if (status) return 0;
  std::fprintf(stderr, "bench_error_time: %s\n", status.error().message.c_str());
  const ErrorCode code = status.error().code;
  return code == ErrorCode::kInvalidArgument || code == ErrorCode::kNotFound ||
                 code == ErrorCode::kUnreadable
             ? 2
             : 1;
}
