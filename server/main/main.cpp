// SPDX-License-Identifier: GPL-3.0-or-later
// brainshiftd: prepares patient models before surgery and serves estimates during it.
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "common/io/files/command_words.hpp"
#include "common/io/files/stop_signals.hpp"
#include "common/linalg/openblas.hpp"
#include "server/main/commands.hpp"

namespace {

using namespace brainshift::server;

#ifndef BRAINSHIFT_MPI
// mpirun's name for the number of processes; 1 without it.
int processes() {
  const char* size = std::getenv("OMPI_COMM_WORLD_SIZE");
  if (size == nullptr) size = std::getenv("PMI_SIZE");
  return size == nullptr ? 1 : std::atoi(size);
}
#endif

// ranks: of brainshiftd-mpi with several processes, else nullptr.
int parse_and_run(int argc, char** argv, brainshift::Ranks* ranks) {
  CLI::App app(
      "Estimates brain shift during surgery from sparse measurements. Research software, no "
      "medical device.",
      "brainshiftd");
  app.set_version_flag("--version", "brainshiftd " BRAINSHIFT_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  brainshiftd prepare --case config/cases/colin27.yaml --out colin27.h5\n"
      "  brainshiftd serve --config config/daemon.yaml --model colin27.h5\n"
      "Exit status: 0 success, 2 bad usage or bad input, 1 failure.");

  // The other program's commands are its own to know: it says what it does not.
  const std::vector<std::string> own = {"prepare", "serve", "health"};
  if (argc > 1 && argv[1][0] != '-' && std::find(own.begin(), own.end(), argv[1]) == own.end()) {
    const std::string typed = argv[1], meant = brainshift::io::nearest_word(typed, own);
    if (meant.empty()) brainshift::io::become("brainshift", argv);
    return print_error({brainshift::ErrorCode::kInvalidArgument,
                        "unknown argument " + typed +
                            (meant.empty() ? "" : ", did you mean " + meant + "?") +
                            " (see brainshiftd --help)"});
  }
  PrepareArguments prepare;
  auto* prepare_command = app.add_subcommand("prepare", "Build a patient's model from a case file");
  prepare_command->add_option("--case", prepare.case_file, "Case file (YAML)")->required();
  prepare_command->add_option("--out", prepare.out, "Model file to write (HDF5)")->required();
  prepare_command->add_flag("--json", prepare.json, "Print one JSON object instead of a table");
  prepare_command
      ->add_option("--threads", prepare.threads,
                   "Threads that condense; 0: as many as the machine has cores")
      ->check(CLI::Range(0, 16));
  prepare_command->footer(
      "Reads the images that the case names, meshes the brain, finds the node sets, factorises "
      "the\n"
      "model under both boundaries, and writes the model file.\n"
      "Examples:\n"
      "  brainshiftd prepare --case config/cases/colin27.yaml --out colin27.h5\n"
      "  brainshiftd prepare --case my.yaml --out my.h5 --json | jq .prepare.contact.factor_s\n"
      "  mpirun -np 8 brainshiftd prepare --case my.yaml --out my.h5   (with brainshiftd-mpi "
      "beside it)");

  ServeArguments serve;
  auto* serve_command =
      app.add_subcommand("serve", "Answer clients until SIGINT, SIGTERM or SIGHUP");
  serve_command->add_option("--config", serve.config_file, "Daemon file (YAML)")->required();
  serve_command->add_option("--model", serve.model, "Model file, instead of the daemon file's");
  serve_command->add_option(
      "--endpoint", serve.endpoint,
      "Where to listen, instead of the daemon file's; port * picks a free one");
  serve_command->footer(
      "Prints \"listening on ENDPOINT\" to stdout when clients can connect; logs to stderr. "
      "Without a\n"
      "model it runs and answers model_not_ready.\n"
      "Examples:\n"
      "  brainshiftd serve --config config/daemon.yaml --model colin27.h5\n"
      "  brainshiftd serve --config config/daemon.yaml --endpoint 'tcp://127.0.0.1:*'");

  HealthArguments health;
  auto* health_command = app.add_subcommand("health", "Ask a running daemon whether it answers");
  health_command->add_option("--config", health.config_file, "The running daemon's file (YAML)")
      ->required();
  health_command->add_option("--endpoint", health.endpoint, "Instead of the daemon file's");
  health_command->footer(
      "For containers and scripts: prints one line; exit status 0 when the daemon answers within\n"
      "3 s, with or without a model, and 1 when it does not. What it is doing tells\n"
      "`brainshift status`.\n"
      "Example:\n"
      "  brainshiftd health --config /etc/brainshift/daemon.yaml");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    // A word that is no subcommand is a better reason than the subcommand that is then missing.
    const auto unknown = app.remaining(true);
    const std::string reason =
        unknown.empty() ? std::string(error.what()) : "unknown argument " + unknown.front();
    if (ranks != nullptr && ranks->rank() > 0) return brainshift::kExitBadInput;
    return print_error(
        {brainshift::ErrorCode::kInvalidArgument, reason + " (see brainshiftd --help)"});
  }
  prepare.ranks = ranks;
  if (prepare_command->parsed()) return run_prepare(prepare);
  if (ranks != nullptr) {
    return print_error(
        {brainshift::ErrorCode::kInvalidArgument,
         "only prepare runs as several processes; start this command without mpirun"});
  }
  if (health_command->parsed()) return run_health(health);
  return run_serve(serve);
}

}  // namespace

int main(int argc, char** argv) {
#ifndef BRAINSHIFT_MPI
  // Under mpirun the program with the parallel MUMPS takes over.
  if (processes() > 1) {
    std::error_code ignored;
    const std::string program =
        std::filesystem::read_symlink("/proc/self/exe", ignored).string() + "-mpi";
    execv(program.c_str(), argv);
    const char* rank = std::getenv("OMPI_COMM_WORLD_RANK");
    if (rank != nullptr && std::atoi(rank) > 0)
      return brainshift::kExitBadInput;  // one line of all
    return print_error(
        {brainshift::ErrorCode::kInvalidArgument,
         std::to_string(processes()) + " processes need " + program +
             " (build option BRAINSHIFT_MPI), which does not run: " + std::strerror(errno)});
  }
#endif
  brainshift::linalg::choose_blas_kernel();
  brainshift::linalg::use_single_threaded_blas();
  brainshift::io::survive_failing_writes();
  umask(077);  // files hold a patient's data
  try {
#ifdef BRAINSHIFT_MPI
    const auto ranks = brainshift::start_ranks(&argc, &argv);
    return parse_and_run(argc, argv, ranks->size() > 1 ? ranks.get() : nullptr);
#else
    return parse_and_run(argc, argv, nullptr);
#endif
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "brainshiftd: unexpected failure: %s\n", exception.what());
    return brainshift::kExitFailure;
  }
}
