// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <sys/stat.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <string>
#include <vector>

#include "client/tools/cli/command.hpp"
#include "common/core/exit_status.hpp"
#include "common/io/files/command_words.hpp"
#include "common/linalg/openblas.hpp"

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  umask(077);  // files hold a patient's data
  using namespace brainshift;
  CLI::App app{
      "brainshift: write a first case of a patient; look at a case before it is prepared; simulate "
      "surgeries with known truth, "
      "replay recorded ones to brainshiftd, and report how well the deformation was recovered; "
      "solve single forward problems on any mesh; import recordings of tracked ultrasound and "
      "landmarks; register patients by fiducials; check, export and mend journals; say what to "
      "measure next; watch a "
      "running brainshiftd; make keys.\n"
      "Research software for simulation, replay and laboratory use; no medical device.",
      "brainshift"};
  app.set_version_flag("--version", "brainshift " BRAINSHIFT_VERSION);
  app.require_subcommand(1);
  app.footer(
      "A whole run, with the daemon in a second terminal:\n"
      "  brainshift preview --case config/cases/colin27.yaml --out preview\n"
      "  brainshiftd prepare --case config/cases/colin27.yaml --out colin27.h5\n"
      "  brainshiftd serve --config config/daemon.yaml --model colin27.h5\n"
      "  brainshift simulate --case config/cases/colin27.yaml --scenario paper --seed 1 --out "
      "paper.surgery\n"
      "  brainshift replay paper.surgery --endpoint tcp://127.0.0.1:5555 --report paper.json\n"
      "  brainshift report paper.json --out report\n"
      "Exit status: 0 success, 2 bad usage or bad input, 1 failure.");

  Status status;
  for (const auto add :
       {client::add_init, client::add_preview, client::add_simulate, client::add_replay,
        client::add_report, client::add_solve, client::add_import, client::add_register,
        client::add_stereo, client::add_journal, client::add_export, client::add_watch,
        client::add_view, client::add_advise, client::add_bridge, client::add_status,
        client::add_top, client::add_keys}) {
    add(app, status);
  }

  // CLI11 would only say that a subcommand is required.
  const auto commands = app.get_subcommands(nullptr);
  const auto named = [&](const CLI::App* command) { return command->check_name(argv[1]); };
  if (argc > 1 && argv[1][0] != '-' && std::none_of(commands.begin(), commands.end(), named)) {
    const std::string typed = argv[1];
    if (typed == "prepare" || typed == "serve" || typed == "health")
      io::become("brainshiftd", argv);
    std::vector<std::string> names;
    for (const CLI::App* command : commands) names.push_back(command->get_name());
    const std::string meant = io::nearest_word(typed, names);
    client::print_error("unknown command \"" + typed + "\"" +
                        (meant.empty() ? "" : ", did you mean " + meant + "?") +
                        ": must be one of " + fmt::format("{}", fmt::join(names, ", ")) +
                        " (see brainshift --help), or of brainshiftd's: prepare, serve, health");
    return kExitBadInput;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    client::print_error(std::string(error.what()) + " (see brainshift --help)");
    return kExitBadInput;
  } catch (const std::exception& error) {
    client::print_error(std::string("internal error: ") + error.what());
    return kExitFailure;
  }
  if (status) return kExitSuccess;
  client::print_error(status.error().message);
  return exit_status(status.error().code);
}
