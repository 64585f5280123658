// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <memory>

#include "client/tools/cli/command.hpp"
#include "client/tools/report/write_report.hpp"
#include "common/io/files/output_path.hpp"

namespace brainshift::client {

void add_report(CLI::App& app, Status& status) {
  auto options = std::make_shared<ReportOptions>();
  CLI::App* command = app.add_subcommand(
      "report", "Tables, pictures and one self-contained html page from replays.");
  command->add_option("reports", options->reports, "report.json files of `brainshift replay`")
      ->required();
  command->add_option("--out", options->out, "folder to fill; made if it is missing")->required();
  command->footer(
      "Writes report.json (all runs), report.html and the pictures as PNG. Example:\n"
      "  brainshift report paper.json paper-icp.json --out report");
  command->callback([options, &status] {
    status = io::check_output_folder("--out", options->out).and_then([&] {
      return write_report(*options, terminal_progress());
    });
  });
}

}  // namespace brainshift::client
