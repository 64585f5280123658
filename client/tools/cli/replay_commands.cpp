// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "client/tools/cli/command.hpp"
#include "client/tools/replay/replay.hpp"
#include "client/tools/replay/verify.hpp"
#include "client/tools/report/write_report.hpp"
#include "common/io/files/output_path.hpp"

namespace brainshift::client {
namespace {

struct ReplayArguments {
  ReplayOptions options;
  KeyOptions keys;
  std::string speed = "max";
  std::string boundary = "contact";
  std::string method;
  double timeout_s = 600.0;
  bool verify = false;
};

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const Method method : kAllMethods) names.emplace_back(to_string(method));
  return names;
}

Status verify(const ReplayOptions& options) {
  const auto verification = verify_journal(
      {options.surgery, options.endpoint, options.timeout, options.takeover, options.keys},
      terminal_progress());
  if (!verification) return tl::unexpected(verification.error());
  print_lines(report_lines(*verification));
  if (verification->differences.empty()) return {};
  return fail(ErrorCode::kNotConverged,
              options.surgery.string() + ": " + std::to_string(verification->differences.size()) +
                  " of " + std::to_string(verification->compared) +
                  " answers differ; the first: " + verification->differences.front());
}

Status run_replay(ReplayArguments arguments) {
  ReplayOptions& options = arguments.options;
  options.speed = arguments.speed == "max" ? Speed::kMax : Speed::kRecorded;
  if (arguments.boundary == "both") options.boundaries = {Boundary::kContact, Boundary::kFixed};
  if (arguments.boundary == "fixed") options.boundaries = {Boundary::kFixed};
  for (const Method method : kAllMethods) {
    if (arguments.method == to_string(method)) options.method = method;
  }
  if (!std::isfinite(arguments.timeout_s)) {  // CLI::Range lets NaN pass
    return invalid("--timeout-s must be a number of seconds");
  }
  options.timeout = std::chrono::milliseconds(static_cast<long>(1e3 * arguments.timeout_s));
  if (Status ok = read_keys(arguments.keys, options.keys); !ok) return ok;
  if (arguments.verify) return verify(options);
  if (options.report.empty()) return invalid("--report is required (see brainshift replay --help)");
  if (Status ok = io::check_output_file("--report", options.report); !ok) return ok;
  if (!options.latency_csv.empty()) {
    if (Status ok = io::check_output_file("--latency-csv", options.latency_csv); !ok) return ok;
  }
  options.on_note = [](const std::string& sentence) {
    std::printf("note: %s\n", sentence.c_str());
  };
  const auto tell = [](const RunReport& run) { print_line(summary_line(run)); };
  return replay(options, terminal_progress(), tell).map([&] {
    print_wrote(options.report, ", and the fields beside it; brainshift report makes a page of it");
  });
}

}  // namespace

void add_replay(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<ReplayArguments>();
  CLI::App* command = app.add_subcommand(
      "replay", "Play a recorded surgery to a running daemon and score its answers.");
  ReplayOptions& options = arguments->options;
  add_required(*command, "surgery", options.surgery, "surgery file (.surgery)");
  add_with_default(*command, "--endpoint", options.endpoint, "where brainshiftd listens");
  add_key_options(*command, arguments->keys);
  CLI::Option* report = command->add_option(
      "--report", options.report,
      "report.json to write; fields go beside it as .vtu; required without --verify");
  CLI::Option* verify =
      command->add_flag("--verify", arguments->verify,
                        "compare the daemon's updates with those of a journal, and write nothing; "
                        "method and boundary are the journal's");
  verify->excludes(report);
  add_with_default(*command, "--speed", arguments->speed,
                   "max: as fast as answers come; 1x: at the recorded times")
      ->check(CLI::IsMember({"max", "1x"}));
  add_with_default(*command, "--boundary", arguments->boundary,
                   "brain-skull boundary condition to estimate with; both: one after the other")
      ->check(CLI::IsMember({"contact", "fixed", "both"}));
  arguments->method = to_string(options.method);
  add_with_default(*command, "--method", arguments->method, "how to invert")
      ->check(CLI::IsMember(method_names()));
  command
      ->add_option("--sources", options.sources,
                   "play the observations of these sources only, e.g. ius,stereopsis")
      ->delimiter(',');
  command
      ->add_option("--resume", options.resume,
                   "journal of a session that crashed: go on after what it holds")
      ->excludes(verify);
  add_with_default(
      *command, "--repeat", options.repeat,
      "play the observations so many times in a cycle, to measure latency; needs --speed max")
      ->check(CLI::Range(1, 1000000));
  command->add_flag("--takeover", options.takeover,
                    "end the session of another client that is still connected");
  command->add_option(
      "--latency-csv", options.latency_csv,
      "also write latency, stage times and contact of every update, a row each; with --boundary "
      "both a file per boundary, \"-contact\" and \"-fixed\" added to its name");
  add_with_default(*command, "--timeout-s", arguments->timeout_s,
                   "longest silence before an observation counts as lost, s")
      ->check(CLI::Range(0.1, 86400.0));
  command->footer(
      "The daemon must serve the case and model that the surgery was recorded with. Example:\n"
      "  brainshift replay paper.surgery --endpoint tcp://127.0.0.1:5555 --speed max --report "
      "paper.json\n"
      "2,000 updates of a surgery with 20 observations, timed one by one:\n"
      "  brainshift replay sag.surgery --repeat 100 --latency-csv "
      "sag_latency.csv --report sag.json\n"
      "After a crash of the daemon, on from the last observation that its journal holds:\n"
      "  brainshift replay sag.surgery --resume journal/colin27-20250131T120000Z-1.surgery "
      "--report rest.json\n"
      "Does this daemon still answer as it did when the journal was recorded? Exit status 1 when "
      "an update differs:\n"
      "  brainshift replay journal/colin27-20250131T120000Z-1.surgery --verify");
  command->callback([arguments, &status] { status = run_replay(*arguments); });
}

void add_report(CLI::App& app, Status& status) {
  auto options = std::make_shared<ReportOptions>();
  CLI::App* command = app.add_subcommand(
      "report", "Tables, pictures and one self-contained html page from replays.");
  add_required(*command, "reports", options->reports, "report.json files of `brainshift replay`");
  add_required(*command, "--out", options->out, "folder to fill; made if it is missing");
  command->footer(
      "Writes report.json (all runs), report.html (at most 5 MB) and the pictures as PNG and SVG. "
      "Example:\n"
      "  brainshift report paper.json paper-icp.json --out report");
  command->callback([options, &status] {
    status =
        io::check_output_folder("--out", options->out)
            .and_then([&] { return write_report(*options, terminal_progress()); })
            .map([&] {
              print_wrote(options->out / "report.html", ", report.json and pictures beside it");
            });
  });
}

}  // namespace brainshift::client
