// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/prepare_command.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/values/brain_model.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/io/model/checkpoint_file.hpp"
#include "common/io/config/config_file.hpp"
#include "common/io/model/model_file.hpp"
#include "common/anatomy/brain_model_builder.hpp"
#include "server/pipeline/scene_plan.hpp"
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
  double total_s = 0.0;
  std::array<PrepareTimings, kBoundaries.size()> timings;
  std::vector<CondensedOperators> condensed;  // one per boundary
  std::uintmax_t file_bytes = 0;
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

// FNV-1a over all that the contact columns depend on.
std::uint64_t checkpoint_key(const BrainModel& model, const CaseConfig& config) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : model.model_id + io::case_config_text(config)) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  }
  return hash;
}

// Blocks 2 i and 2 i + 1 of the file are the columns and the compliance of block i. A block that cannot be kept is
// solved again next time; the preparation goes on.
inversion::BlockStore block_store(io::CheckpointFile& file) {
  inversion::BlockStore store;
  store.load = [&file](int index, Eigen::MatrixXf& columns, Eigen::MatrixXd& compliance) {
    return file.has(2 * index) && file.has(2 * index + 1) && file.read(2 * index, columns) &&
           file.read(2 * index + 1, compliance);
  };
  store.save = [&file](int index, const Eigen::MatrixXf& columns,
                       const Eigen::MatrixXd& compliance) {
    if (!file.has(2 * index)) (void)file.append(2 * index, columns);
    if (!file.has(2 * index + 1)) (void)file.append(2 * index + 1, compliance);
  };
  return store;
}

// Factorises and condenses; an interrupted run is taken up from `checkpoint`.
Status prepare_boundary(Outcome& outcome, std::size_t which, const CaseConfig& config,
                        io::CheckpointFile& checkpoint, ProgressBar& bar) {
  const auto start = Clock::now();
  const Boundary boundary = kBoundaries[which];
  const Progress progress = bar.progress(std::string(to_string(boundary)));
  const auto prepared = PreparedModel::prepare(outcome.model, config, boundary, progress);
  if (!prepared) return tl::unexpected(prepared.error());
  outcome.timings[which] = prepared->timings();
  inversion::CondenseOptions options;
  options.progress = progress;
  if (boundary == Boundary::kContact) options.store = block_store(checkpoint);
  auto condensed = inversion::condense(*prepared, options);
  if (!condensed) return tl::unexpected(condensed.error());
  condensed->prepare_s = seconds_since(start);
  outcome.condensed.push_back(std::move(*condensed));
  return {};
}

Result<Outcome> prepare(const PrepareArguments& arguments, ProgressBar& bar) {
  const auto whole_start = Clock::now();
  if (auto status = check_output(arguments.out); !status) return tl::unexpected(status.error());
  auto config = io::read_case_config(arguments.case_file);
  if (!config) return tl::unexpected(config.error());
  if (auto plan = server::plan_scene(*config, Method::kCondensed, Boundary::kContact); !plan) {
    return tl::unexpected(plan.error());
  }

  Outcome outcome;
  auto start = Clock::now();
  bar.show("", "read images", 0.0);
  auto recorded = io::record_inputs(*config);
  if (!recorded) return tl::unexpected(recorded.error());
  const auto inputs = io::load_case_inputs(*config);
  if (!inputs) return tl::unexpected(inputs.error());
  outcome.read_s = seconds_since(start);

  start = Clock::now();
  auto model = anatomy::build_brain_model(*inputs, bar.progress(""));
  if (!model) return tl::unexpected(model.error());
  outcome.model = std::make_shared<const BrainModel>(std::move(*model));
  outcome.mesh_s = seconds_since(start);

  const std::filesystem::path partial = arguments.out.string() + ".partial";
  auto checkpoint =
      io::CheckpointFile::open_or_create(partial, checkpoint_key(*outcome.model, *config));
  if (!checkpoint) return tl::unexpected(checkpoint.error());
  if (!checkpoint->blocks().empty()) {
    bar.note(fmt::format("going on from {} of an interrupted run", partial.string()));
  }
  for (std::size_t i = 0; i < kBoundaries.size(); ++i) {
    auto status = prepare_boundary(outcome, i, *config, *checkpoint, bar);
    if (status) continue;
    if (checkpoint->blocks().empty()) (void)checkpoint->remove();
    return tl::unexpected(status.error());
  }

  bar.show("", "write model", 1.0);
  io::ModelFile file{std::move(*config), *outcome.model, std::move(outcome.condensed),
                     std::move(*recorded)};
  auto written = io::write_model(arguments.out, file);
  if (!written) return tl::unexpected(written.error());
  outcome.condensed = std::move(file.condensed);
  if (auto removed = checkpoint->remove(); !removed) return tl::unexpected(removed.error());
  std::error_code ignored;
  outcome.file_bytes = std::filesystem::file_size(arguments.out, ignored);
  outcome.total_s = seconds_since(whole_start);
  return outcome;
}

// Of this process so far, bytes.
std::uint64_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
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
        {"bytes", timings.bytes},
        {"condensed_s", outcome.condensed[i].prepare_s},
        {"condensed_modes", outcome.condensed[i].num_modes()},
        {"condensed_bytes", outcome.condensed[i].bytes()}};
  }
  json["total_s"] = outcome.total_s;
  json["model_file_bytes"] = outcome.file_bytes;
  json["peak_memory_bytes"] = peak_memory();
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
  fmt::print("{:<10}{:>11}{:>11}{:>11}{:>11}{:>12}{:>13}{:>7}{:>9}\n", "boundary", "assemble s",
             "analyse s", "factor s", "t_solve ms", "nnz(L)", "condensed s", "modes", "MiB");
  for (std::size_t i = 0; i < kBoundaries.size(); ++i) {
    const PrepareTimings& t = outcome.timings[i];
    const CondensedOperators& condensed = outcome.condensed[i];
    fmt::print("{:<10}{:>11.2f}{:>11.2f}{:>11.2f}{:>11.1f}{:>12}{:>13.1f}{:>7}{:>9.0f}\n",
               to_string(kBoundaries[i]), t.assemble_s, t.analyse_s, t.factor_s, t.full_solve_ms,
               t.factor_nonzeros, condensed.prepare_s, condensed.num_modes(),
               static_cast<double>(condensed.bytes()) / 1048576.0);
  }
  fmt::print("\nwrote {} ({:.0f} MiB) in {:.1f} s, peak memory {:.2f} GiB\n", out.string(),
             static_cast<double>(outcome.file_bytes) / 1048576.0, outcome.total_s,
             static_cast<double>(peak_memory()) / 1073741824.0);
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
