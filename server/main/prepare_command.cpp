// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/prepare_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "common/core/brain_model.hpp"
#include "common/inversion/prepared_model.hpp"
#include "common/io/config_file.hpp"
#include "common/io/model_file.hpp"
#include "common/scene/brain_model_builder.hpp"
#include "common/scene/scene_plan.hpp"
#include "server/main/exit_status.hpp"
#include "server/main/progress_bar.hpp"

namespace brainshift::server {
namespace {

using Clock = std::chrono::steady_clock;
using inversion::PreparedModel;
using inversion::PrepareTimings;

constexpr std::array kBoundaries = {Boundary::kContact, Boundary::kFixed};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Outcome {
  std::shared_ptr<const BrainModel> model;
  double read_s = 0.0;
  double mesh_s = 0.0;
  std::array<PrepareTimings, kBoundaries.size()> timings;
};

// Found out before minutes of work rather than after.
Status check_output(const std::filesystem::path& out) {
  const auto folder = out.has_parent_path() ? out.parent_path() : std::filesystem::path(".");
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored)) {
    return fail(ErrorCode::kNotFound,
                fmt::format("{}: the folder {} does not exist", out.string(), folder.string()));
  }
  if (std::filesystem::is_directory(out, ignored)) {
    return fail(ErrorCode::kInvalidArgument,
                fmt::format("{}: is a folder, --out must name a file", out.string()));
  }
  return {};
}

Result<Outcome> prepare(const PrepareArguments& arguments, ProgressBar& bar) {
  if (auto status = check_output(arguments.out); !status) return tl::unexpected(status.error());
  auto config = io::read_case_config(arguments.case_file);
  if (!config) return tl::unexpected(config.error());
  if (auto plan = scene::plan_scene(*config, Method::kCondensed, Boundary::kContact); !plan) {
    return tl::unexpected(plan.error());
  }

  Outcome outcome;
  auto start = Clock::now();
  bar.show("", "read images", 0.0);
  const auto inputs = io::load_case_inputs(*config);
  if (!inputs) return tl::unexpected(inputs.error());
  outcome.read_s = seconds_since(start);

  start = Clock::now();
  auto model = scene::build_brain_model(*inputs, bar.progress(""));
  if (!model) return tl::unexpected(model.error());
  outcome.model = std::make_shared<const BrainModel>(std::move(*model));
  outcome.mesh_s = seconds_since(start);

  for (std::size_t i = 0; i < kBoundaries.size(); ++i) {
    const std::string name(to_string(kBoundaries[i]));
    const auto prepared =
        PreparedModel::prepare(outcome.model, *config, kBoundaries[i], bar.progress(name));
    if (!prepared) return tl::unexpected(prepared.error());
    outcome.timings[i] = prepared->timings();
  }

  bar.show("", "write model", 1.0);
  auto written = io::write_model(arguments.out, {std::move(*config), *outcome.model});
  if (!written) return tl::unexpected(written.error());
  return outcome;
}

nlohmann::json to_json(const Outcome& outcome, const std::filesystem::path& out) {
  const BrainModel& model = *outcome.model;
  nlohmann::json json = {
      {"case", model.case_id},
      {"model_id", model.model_id},
      {"out", out.string()},
      {"mesh", {{"nodes", model.mesh.num_nodes()}, {"tets", model.mesh.num_tets()}}},
      {"sets",
       {{"craniotomy", model.craniotomy.size()},
        {"brainstem", model.brainstem.size()},
        {"slaves", model.slaves.size()},
        {"fixed", model.fixed.size()}}},
      {"read_s", outcome.read_s},
      {"mesh_s", outcome.mesh_s}};
  for (std::size_t i = 0; i < kBoundaries.size(); ++i) {
    const PrepareTimings& timings = outcome.timings[i];
    json["prepare"][std::string(to_string(kBoundaries[i]))] = {
        {"assemble_s", timings.assemble_s},
        {"analyse_s", timings.analyse_s},
        {"factor_s", timings.factor_s},
        {"prior_s", timings.prior_s},
        {"total_s", timings.total_s},
        {"full_solve_ms", timings.full_solve_ms},
        {"factor_nonzeros", timings.factor_nonzeros},
        {"bytes", timings.bytes}};
  }
  return json;
}

void print_table(const Outcome& outcome, const std::filesystem::path& out) {
  const BrainModel& model = *outcome.model;
  fmt::print("case        {}   model {}\n", model.case_id, model.model_id);
  fmt::print("mesh        {} nodes, {} tetrahedra ({:.1f} s)\n", model.mesh.num_nodes(),
             model.mesh.num_tets(), outcome.mesh_s);
  fmt::print("node sets   craniotomy {}, brainstem {}, slaves {}, fixed {}\n\n",
             model.craniotomy.size(), model.brainstem.size(), model.slaves.size(),
             model.fixed.size());
  fmt::print("{:<10}{:>11}{:>11}{:>11}{:>9}{:>9}{:>11}{:>12}{:>9}\n", "boundary", "assemble s",
             "analyse s", "factor s", "prior s", "total s", "t_solve ms", "nnz(L)", "MiB");
  for (std::size_t i = 0; i < kBoundaries.size(); ++i) {
    const PrepareTimings& t = outcome.timings[i];
    fmt::print("{:<10}{:>11.2f}{:>11.2f}{:>11.2f}{:>9.2f}{:>9.2f}{:>11.1f}{:>12}{:>9.0f}\n",
               to_string(kBoundaries[i]), t.assemble_s, t.analyse_s, t.factor_s, t.prior_s,
               t.total_s, t.full_solve_ms, t.factor_nonzeros,
               static_cast<double>(t.bytes) / 1048576.0);
  }
  fmt::print("\nwrote {}\n", out.string());
}

}  // namespace

int run_prepare(const PrepareArguments& arguments) {
  ProgressBar bar(isatty(STDERR_FILENO) == 1 ? ProgressBar::Style::kBar
                  : arguments.json           ? ProgressBar::Style::kSilent
                                             : ProgressBar::Style::kLines);
  const auto outcome = prepare(arguments, bar);
  bar.clear();
  if (!outcome) return print_error(outcome.error());
  if (arguments.json) {
    fmt::print("{}\n", to_json(*outcome, arguments.out).dump());
  } else {
    print_table(*outcome, arguments.out);
  }
  return kExitSuccess;
}

}  // namespace brainshift::server
