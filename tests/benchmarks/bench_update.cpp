// SPDX-License-Identifier: GPL-3.0-or-later
// How long an update takes and where the time goes: surgeries played through the daemon's pipeline
// in this process, beside the time of one triangular solve with the model's factor.
//   build/release/bin/bench_update --model M.h5 [--passes N] [--csv FILE] S.surgery...
// With --limits-csv a row per surgery: what the answer of its median update takes at least, read
// once and computed once at the speed of this machine: the linear model of its last set, one field.
//   read      compliance of the active slaves, their modes, what data see of both, columns of modes
//             and of active slaves that the field is summed from
//   compute   factor of that compliance, response of the slaves to the modes, Jacobian, its Gram
//             matrix and factor
//   limit     the longer of the two, ms; machine: bytes and operations per second with all threads
// With --fields the estimates are written too, for update_difference.py, which compares those of
// two builds. Every update of the first pass: number of nodes n and of active slaves k, int32; 3n
// displacements, mm, and n standard deviations, mm, float64; k nodes, int32.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "common/contact/forward_model.hpp"
#include "common/core/statistics.hpp"
#include "common/core/stopwatch.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/inverter.hpp"
#include "common/io/model/model_file.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/linalg/blas.hpp"
#include "common/linalg/openblas.hpp"
#include "common/pipeline/pipeline.hpp"
#include "common/wire/convert.hpp"
#include "tests/benchmarks/tools.hpp"

namespace brainshift {
namespace {

using bench::value_or_exit;
using inversion::UpdateProfile;
using inversion::UpdateStage;

struct Arguments {
  std::string model_file, csv, stages_csv, limits_csv, fields;
  std::vector<std::string> surgeries;
  int passes = 5;
};

struct Head {
  CaseConfig config;
  std::shared_ptr<const BrainModel> model;
  std::shared_ptr<const CondensedOperators> operators;
  std::shared_ptr<const geometry::TetLocator> locator;
  double t_solve_ms = 0.0;
};

Head load(const std::string& file) {
  auto read = value_or_exit(io::read_model(file));
  Head head;
  head.config = read.config;
  head.model = std::make_shared<const BrainModel>(std::move(read.model));
  for (auto& operators : read.condensed) {
    if (operators.boundary != Boundary::kContact) continue;
    head.operators = std::make_shared<const CondensedOperators>(std::move(operators));
  }
  if (head.operators == nullptr) {
    std::fprintf(stderr, "benchmark: %s: holds no operators for contact\n", file.c_str());
    std::exit(2);
  }
  head.locator = std::make_shared<const geometry::TetLocator>(head.model->mesh);
  const auto prepared =
      value_or_exit(inversion::PreparedModel::prepare(head.model, head.config, Boundary::kContact));
  head.t_solve_ms = contact::measure_full_solve_ms(prepared.forward());
  return head;
}

// A session's pipeline, and the inverter inside it.
struct Player {
  explicit Player(const Head& head) {
    auto made =
        value_or_exit(inversion::condensed_inverter(head.operators, head.locator, head.config));
    inverter = made.get();
    pipeline = std::make_unique<pipeline::Pipeline>(value_or_exit(pipeline::Pipeline::build(
        *head.model, head.config, Method::kCondensed, Boundary::kContact, std::move(made))));
  }
  const inversion::Inverter* inverter = nullptr;
  std::unique_ptr<pipeline::Pipeline> pipeline;
};

struct Timed {
  std::vector<double> ms, active, steps, rows;
  std::vector<std::vector<double>> stage_ms, stage_times;
};

std::vector<Observation> observations_of(const std::string& file) {
  const auto surgery = value_or_exit(io::SurgeryFile::open(file));
  std::vector<Observation> observations;
  for (const auto& record : value_or_exit(surgery.records(io::RecordKind::kObservation))) {
    observations.push_back(value_or_exit(wire::decode_observation(record.payload)));
  }
  return observations;
}

void write_field(const Estimate& estimate, std::ofstream& out) {
  const auto write = [&out](const auto* data, std::size_t count) {
    out.write(reinterpret_cast<const char*>(data),
              static_cast<std::streamsize>(count * sizeof(*data)));
  };
  const std::int32_t sizes[] = {static_cast<std::int32_t>(estimate.displacement.cols()),
                                static_cast<std::int32_t>(estimate.active_slaves.size())};
  write(sizes, 2);
  write(estimate.displacement.data(), static_cast<std::size_t>(estimate.displacement.size()));
  write(estimate.sd_mm.data(), static_cast<std::size_t>(estimate.sd_mm.size()));
  write(estimate.active_slaves.data(), estimate.active_slaves.size());
}

// Rows of the Jacobian: three for a landmark, one for a distance.
double rows_of(const Observation& observation, const Update& update,
               std::map<std::string, int>& rows_of_source) {
  rows_of_source[observation.source] =
      std::holds_alternative<LandmarkPairs>(observation.body) ? 3 : 1;
  double rows = 0.0;
  for (const SourceSummary& source : update.estimate.sources) {
    rows += source.data * rows_of_source[source.source];
  }
  return rows;
}

Timed play(Player& player, const std::vector<Observation>& observations, int passes,
           std::ofstream& fields) {
  Timed timed;
  timed.stage_ms.resize(inversion::kUpdateStages);
  timed.stage_times.resize(inversion::kUpdateStages);
  for (int pass = 0; pass < passes; ++pass) {
    player.pipeline->reset();
    std::map<std::string, int> rows_of_source;
    for (const Observation& observation : observations) {
      const Stopwatch watch;
      const Update update = value_or_exit(player.pipeline->run(observation));
      timed.ms.push_back(watch.milliseconds());
      if (pass == 0 && fields.is_open()) write_field(update.estimate, fields);
      timed.active.push_back(update.estimate.contact.active);
      timed.steps.push_back(update.estimate.contact.iterations);
      timed.rows.push_back(rows_of(observation, update, rows_of_source));
      const UpdateProfile& profile = *player.inverter->profile();
      for (std::size_t i = 0; i < inversion::kUpdateStages; ++i) {
        timed.stage_ms[i].push_back(profile.stages[i].ms);
        timed.stage_times[i].push_back(profile.stages[i].times);
      }
    }
  }
  return timed;
}

void print(const std::string& name, const Timed& timed, double t_solve_ms) {
  const auto median = [](const std::vector<double>& values) { return percentile(values, 50.0); };
  std::printf(
      "%s: %zu updates, p50 %.1f ms = %.2f t_solve, p95 %.2f, p99 / p50 %.2f; %.0f active, "
      "%.0f steps\n",
      name.c_str(), timed.ms.size(), median(timed.ms), median(timed.ms) / t_solve_ms,
      percentile(timed.ms, 95.0) / t_solve_ms, percentile(timed.ms, 99.0) / median(timed.ms),
      median(timed.active), median(timed.steps));
  for (std::size_t i = 0; i < inversion::kUpdateStages; ++i) {
    std::printf("  %-10s %7.2f ms  %5.2f t_solve  %4.0f times\n",
                inversion::to_string(static_cast<UpdateStage>(i)), median(timed.stage_ms[i]),
                median(timed.stage_ms[i]) / t_solve_ms, median(timed.stage_times[i]));
  }
}

void write_stages(const std::string& name, const Timed& timed, double t_solve_ms,
                  std::ofstream& csv) {
  const auto row = [&](const char* stage, const std::vector<double>& ms, double times) {
    const double median = percentile(ms, 50.0);
    csv << name << ',' << stage << ',' << median << ',' << median / t_solve_ms << ',' << times
        << '\n';
  };
  for (std::size_t i = 0; i < inversion::kUpdateStages; ++i) {
    row(inversion::to_string(static_cast<UpdateStage>(i)), timed.stage_ms[i],
        percentile(timed.stage_times[i], 50.0));
  }
  row("update", timed.ms, 1);
}

struct Speed {
  double bytes_per_ms = 0.0, operations_per_ms = 0.0;
};

// Of all threads together: sums over more memory than caches hold, products of matrices.
Speed measure_speed() {
  constexpr long kNumbers = 1L << 26, kSide = 1024;
  ThreadTeam team(0);
  const VecX numbers = VecX::Ones(kNumbers);
  std::vector<double> sums(static_cast<std::size_t>(team.size()));
  const double reading_ms = bench::median_ms(
      [&] {
        auto sum = [&](int member) {
          const long part = kNumbers / team.size();
          sums[static_cast<std::size_t>(member)] = numbers.segment(member * part, part).sum();
        };
        team.run(sum);
      },
      7, 1);
  const Eigen::MatrixXd a = Eigen::MatrixXd::Ones(kSide, kSide);
  Eigen::MatrixXd b = a;
  const double computing_ms = bench::median_ms(
      [&] {
        team.split(kSide, [&](long begin, long end) {
          linalg::blas::multiply(1.0, a, a.middleCols(begin, end - begin), 0.0,
                                 b.middleCols(begin, end - begin));
        });
      },
      7, 1);
  return {8.0 * kNumbers / reading_ms, 2.0 * kSide * kSide * kSide / computing_ms};
}

void write_limit(const std::string& name, const Timed& timed, const CondensedOperators& operators,
                 const Speed& speed, std::ofstream& csv) {
  const double k = percentile(timed.active, 50.0), rows = percentile(timed.rows, 50.0);
  const double r = operators.num_modes(), s = operators.num_slaves();
  const double bytes = 8.0 * k * (0.5 * k + r) + 4.0 * rows * (r + k) +
                       static_cast<double>(operators.responses.bytes()) * (r + k) / (r + s);
  const double operations =
      k * k * k / 3.0 + 2.0 * k * k * r + 2.0 * rows * k * r + rows * r * r + r * r * r / 3.0;
  const double limit_ms =
      std::max(bytes / speed.bytes_per_ms, operations / speed.operations_per_ms);
  csv << name << ',' << percentile(timed.ms, 50.0) << ',' << k << ',' << rows << ',' << bytes << ','
      << operations << ',' << limit_ms << ',' << 1e3 * speed.bytes_per_ms << ','
      << 1e3 * speed.operations_per_ms << '\n';
}

void run(const Arguments& arguments) {
  const Head head = load(arguments.model_file);
  std::printf("%d nodes, %d slaves, %d modes; t_solve %.1f ms; BLAS kernel %s\n",
              head.operators->num_nodes(), head.operators->num_slaves(),
              head.operators->num_modes(), head.t_solve_ms, linalg::blas_kernel().c_str());
  std::ofstream csv;
  if (!arguments.csv.empty()) csv.open(arguments.csv);
  if (csv.is_open()) csv << "surgery,update,ms,t_solve_ms,active,steps\n";
  std::ofstream stages;
  if (!arguments.stages_csv.empty()) stages.open(arguments.stages_csv);
  if (stages.is_open()) stages << "surgery,stage,p50_ms,over_tsolve,times\n";
  std::ofstream limits;
  if (!arguments.limits_csv.empty()) limits.open(arguments.limits_csv);
  if (limits.is_open()) {
    limits << "surgery,p50_ms,active,rows,bytes,operations,limit_ms,bytes_per_s,operations_per_s\n";
  }
  const Speed speed = limits.is_open() ? measure_speed() : Speed();
  std::ofstream fields;
  if (!arguments.fields.empty()) fields.open(arguments.fields, std::ios::binary);
  Player player(head);
  for (const std::string& file : arguments.surgeries) {
    const auto observations = observations_of(file);
    const std::string name = std::filesystem::path(file).stem().string();
    const Timed timed = play(player, observations, arguments.passes, fields);
    print(name, timed, head.t_solve_ms);
    if (stages.is_open()) write_stages(name, timed, head.t_solve_ms, stages);
    if (limits.is_open()) write_limit(name, timed, *head.operators, speed, limits);
    for (std::size_t i = 0; csv.is_open() && i < timed.ms.size(); ++i) {
      csv << name << ',' << i + 1 << ',' << timed.ms[i] << ',' << head.t_solve_ms << ','
          << timed.active[i] << ',' << timed.steps[i] << '\n';
    }
  }
}

}  // namespace
}  // namespace brainshift

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::Arguments arguments;
  CLI::App app("Times updates and their stages.");
  app.add_option("--model", arguments.model_file, "model file of brainshiftd prepare")->required();
  app.add_option("--passes", arguments.passes, "how often each surgery is played")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  app.add_option("--csv", arguments.csv, "file for a row per update");
  app.add_option("--stages-csv", arguments.stages_csv, "file for a row per surgery and stage");
  app.add_option("--limits-csv", arguments.limits_csv,
                 "file for a row per surgery: bytes, operations, and their time at least");
  app.add_option("--fields", arguments.fields, "file for the estimates, see update_difference.py");
  app.add_option("surgeries", arguments.surgeries, "surgery files of the same case")->required();
  CLI11_PARSE(app, argc, argv);
  brainshift::run(arguments);
  return 0;
}
