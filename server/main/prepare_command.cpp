// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/commands.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstddef>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/stopwatch.hpp"
#include "common/io/config/config_file.hpp"
#include "common/io/files/output_path.hpp"
#include "common/io/model/model_file.hpp"
#include "common/patient/prepare_model.hpp"
#include "common/pipeline/scene.hpp"
#include "server/main/progress_bar.hpp"

namespace brainshift::server {
namespace {

using patient::kPreparedBoundaries;
using patient::PreparedPatient;

// Of one process.
struct Usage {
  std::uint64_t peak_memory_bytes = 0, bytes_sent = 0;
  double processor_s = 0.0, exchange_s = 0.0;
};

struct Outcome {
  PreparedPatient patient;
  std::vector<Usage> ranks;
  std::uintmax_t file_bytes = 0;
  double total_s = 0.0;
  std::optional<io::OldModel> replaced;
};

// Of the whole preparation: patient::prepare_model puts the boundary before what it does for it.
std::string_view step_of(std::string_view stage) {
  if (stage.starts_with(to_string(Boundary::kFixed))) return "step 2 of 4";
  return stage.starts_with(to_string(Boundary::kContact)) ? "step 3 of 4" : "step 1 of 4";
}

// Of this process so far.
Usage usage_of(const Ranks::Traffic& traffic) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return {static_cast<std::uint64_t>(usage.ru_maxrss) * 1024, traffic.bytes_sent,
          seconds(usage.ru_utime) + seconds(usage.ru_stime), traffic.seconds};
}

std::vector<Usage> usage_of_all(Ranks* ranks) {
  if (ranks == nullptr) return {usage_of({})};
  const Usage own = usage_of(ranks->traffic());
  const auto* bytes = reinterpret_cast<const std::byte*>(&own);
  std::vector<Usage> all;
  for (const auto& message : ranks->exchange(std::vector<Ranks::Bytes>(
           static_cast<std::size_t>(ranks->size()), Ranks::Bytes(bytes, bytes + sizeof own)))) {
    std::memcpy(&all.emplace_back(), message.data(), sizeof own);
  }
  return all;
}

Result<std::optional<io::OldModel>> model_to_replace(const std::filesystem::path& out) {
  auto old = io::model_to_replace(out);
  if (!old) return fail(old.error().code, "--out: " + old.error().message);
  return old;
}

Result<CaseConfig> check_arguments(const PrepareArguments& arguments,
                                   const std::filesystem::path& checkpoint) {
  for (const std::filesystem::path& path : {arguments.out, checkpoint}) {
    if (auto ok = io::check_output_file("--out", path); !ok) return tl::unexpected(ok.error());
  }
  std::error_code ignored;
  if (std::filesystem::equivalent(arguments.out, arguments.case_file, ignored)) {
    return invalid("--out: " + arguments.out.string() + ": is the case itself");
  }
  // Before the work; once more before the file is written.
  if (auto old = model_to_replace(arguments.out); !old) return tl::unexpected(old.error());
  auto config = io::read_case_config(arguments.case_file);
  if (!config) return config;
  if (auto plan = pipeline::plan_scene(*config, Method::kCondensed, Boundary::kContact); !plan) {
    return tl::unexpected(plan.error());
  }
  return config;
}

Result<Outcome> prepare(const PrepareArguments& arguments, ProgressBar& bar) {
  const Stopwatch whole;
  const auto agreed = [&](const auto& own) {
    const Status status = own ? Status{} : Status(tl::unexpected(own.error()));
    return arguments.ranks != nullptr ? arguments.ranks->agree(status) : status;
  };
  patient::PrepareOptions options;
  options.checkpoint = arguments.out.string() + ".partial";
  const auto config = check_arguments(arguments, options.checkpoint);
  if (auto ok = agreed(config); !ok) return tl::unexpected(ok.error());
  const bool first = arguments.ranks == nullptr || arguments.ranks->rank() == 0;
  options.ranks = arguments.ranks;
  options.threads = arguments.threads;
  if (first) {
    options.progress = [&bar](std::string_view stage, double fraction) {
      bar.show(step_of(stage), stage, fraction);
    };
  }
  options.on_resume = [&] {
    bar.note(fmt::format("going on from {} of an interrupted run", options.checkpoint.string()));
  };
  auto prepared = patient::prepare_model(*config, options);
  if (!prepared) return tl::unexpected(prepared.error());
  if (first) {
    for (const std::string& note : prepared->notes) {
      bar.note(fmt::format("{}: {}", arguments.case_file.string(), note));
    }
  }
  Status written;
  std::optional<io::OldModel> replaced;
  if (first) {
    bar.show("step 4 of 4", "write model", 1.0);
    auto old = model_to_replace(arguments.out);
    written =
        old ? io::write_model(arguments.out, prepared->file) : Status(tl::unexpected(old.error()));
    if (written && *old) {
      bar.note(replacement_text(arguments.out, **old, prepared->file.model));
      replaced = std::move(*old);
    }
  }
  if (auto ok = agreed(written); !ok) return tl::unexpected(ok.error());
  if (auto ok = agreed(prepared->checkpoint->remove()); !ok) return tl::unexpected(ok.error());
  std::error_code ignored;
  return Outcome{std::move(*prepared), usage_of_all(arguments.ranks),
                 std::filesystem::file_size(arguments.out, ignored), whole.seconds(),
                 std::move(replaced)};
}

nlohmann::json to_json(const Outcome& outcome, const std::filesystem::path& out) {
  const BrainModel& model = outcome.patient.file.model;
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
      {"notes", outcome.patient.notes},
      {"read_s", outcome.patient.read_s},
      {"mesh_s", outcome.patient.mesh_s}};
  for (std::size_t i = 0; i < kPreparedBoundaries.size(); ++i) {
    const inversion::PrepareTimings& timings = outcome.patient.timings[i];
    const CondensedOperators& condensed = outcome.patient.file.condensed[i];
    json["prepare"][std::string(to_string(kPreparedBoundaries[i]))] = {
        {"assemble_s", timings.assemble_s},
        {"analyse_s", timings.analyse_s},
        {"factor_s", timings.factor_s},
        {"prior_s", timings.prior_s},
        {"total_s", timings.total_s},
        {"factor_nonzeros", timings.factor_nonzeros},
        {"bytes", timings.bytes},
        {"condensed_s", condensed.prepare_s},
        {"condensed_modes", condensed.num_modes()},
        {"condensed_bytes", condensed.bytes()}};
  }
  if (outcome.replaced) {
    json["replaced"] = {{"case", outcome.replaced->case_id},
                        {"model_id", outcome.replaced->model_id},
                        {"same", outcome.replaced->model_id == model.model_id}};
  }
  json["total_s"] = outcome.total_s;
  json["model_file_bytes"] = outcome.file_bytes;
  json["peak_memory_bytes"] = outcome.ranks.front().peak_memory_bytes;
  json["processor_s"] = outcome.ranks.front().processor_s;
  for (std::size_t r = 0; outcome.ranks.size() > 1 && r < outcome.ranks.size(); ++r) {
    const Usage& rank = outcome.ranks[r];
    json["ranks"].push_back({{"peak_memory_bytes", rank.peak_memory_bytes},
                             {"bytes_sent", rank.bytes_sent},
                             {"processor_s", rank.processor_s},
                             {"exchange_s", rank.exchange_s}});
  }
  return json;
}

void print_table(const Outcome& outcome, const std::filesystem::path& out) {
  const BrainModel& model = outcome.patient.file.model;
  fmt::print("case        {}   model {}\n", model.case_id, model.model_id);
  fmt::print("mesh        {} nodes, {} tetrahedra ({:.1f} s)\n", model.mesh.num_nodes(),
             model.mesh.num_tets(), outcome.patient.mesh_s);
  fmt::print("node sets   craniotomy {}, brainstem {}, slaves {}, fixed {}\n",
             model.craniotomy.size(), model.brainstem.size(), model.slaves.size(),
             model.fixed.size());
  if (!model.septa.slaves.empty()) {
    fmt::print("anatomy     {} nodes may touch falx and tentorium\n", model.septa.slaves.size());
  }
  fmt::print("\n");
  fmt::print("{:<10}{:>11}{:>11}{:>11}{:>12}{:>13}{:>7}{:>9}\n", "boundary", "assemble s",
             "analyse s", "factor s", "nnz(L)", "condensed s", "modes", "MiB");
  for (std::size_t i = 0; i < kPreparedBoundaries.size(); ++i) {
    const inversion::PrepareTimings& t = outcome.patient.timings[i];
    const CondensedOperators& condensed = outcome.patient.file.condensed[i];
    fmt::print("{:<10}{:>11.2f}{:>11.2f}{:>11.2f}{:>12}{:>13.1f}{:>7}{:>9.0f}\n",
               to_string(kPreparedBoundaries[i]), t.assemble_s, t.analyse_s, t.factor_s,
               t.factor_nonzeros, condensed.prepare_s, condensed.num_modes(),
               static_cast<double>(condensed.bytes()) / 1048576.0);
  }
  fmt::print("\nwrote {} ({:.0f} MiB) in {:.1f} s, peak memory {:.2f} GiB\n", out.string(),
             static_cast<double>(outcome.file_bytes) / 1048576.0, outcome.total_s,
             static_cast<double>(outcome.ranks.front().peak_memory_bytes) / 1073741824.0);
  for (std::size_t r = 0; outcome.ranks.size() > 1 && r < outcome.ranks.size(); ++r) {
    fmt::print("process {}: peak memory {:.2f} GiB, sent {:.2f} GiB\n", r,
               static_cast<double>(outcome.ranks[r].peak_memory_bytes) / 1073741824.0,
               static_cast<double>(outcome.ranks[r].bytes_sent) / 1073741824.0);
  }
}

}  // namespace

std::string replacement_text(const std::filesystem::path& out, const io::OldModel& old,
                             const BrainModel& made) {
  const std::string there = out.string() + ": replaces ";
  if (!old.unreadable.empty()) return there + "a model that cannot be read: " + old.unreadable;
  return there + fmt::format("the model of case {}, {}: {}", old.case_id, old.model_id,
                             old.model_id == made.model_id
                                 ? "the new one is the same"
                                 : "the new one is another, " + made.model_id);
}

int run_prepare(const PrepareArguments& arguments) {
  const bool first = arguments.ranks == nullptr || arguments.ranks->rank() == 0;
  ProgressBar bar(!first                       ? ProgressBar::Style::kSilent
                  : isatty(STDERR_FILENO) == 1 ? ProgressBar::Style::kBar
                  : arguments.json             ? ProgressBar::Style::kSilent
                                               : ProgressBar::Style::kLines);
  const auto outcome = prepare(arguments, bar);
  bar.clear();
  if (!outcome) return first ? print_error(outcome.error()) : exit_status(outcome.error().code);
  if (!first) return kExitSuccess;
  if (arguments.json) {
    fmt::print("{}\n", to_json(*outcome, arguments.out).dump());
  } else {
    print_table(*outcome, arguments.out);
  }
  return kExitSuccess;
}

}  // namespace brainshift::server
