// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "client/tools/cli/command.hpp"
#include "client/tools/preview/preview.hpp"
#include "common/io/files/output_path.hpp"

namespace brainshift::client {
namespace {

struct PreviewArguments {
  std::filesystem::path case_file;
  std::filesystem::path out;
};

Status run_preview(const PreviewArguments& arguments) {
  if (Status ok = io::check_output_folder("--out", arguments.out); !ok) return ok;
  const auto summary = write_preview(arguments.case_file, arguments.out, terminal_progress());
  if (!summary) return tl::unexpected(summary.error());
  for (const std::string& line : summary->facts) std::printf("%s\n", line.c_str());
  for (const std::string& line : summary->doubts) std::printf("look again: %s\n", line.c_str());
  for (const auto& file : summary->files) std::printf("wrote %s\n", file.c_str());
  if (summary->problems.empty()) return {};
  return fail(ErrorCode::kInvalidArgument,
              arguments.case_file.string() + ": cannot be prepared: " + summary->problems.front());
}

}  // namespace

void add_preview(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<PreviewArguments>();
  CLI::App* command = app.add_subcommand(
      "preview", "Draw a case before it is prepared: brain, tumour, opening, gravity, contact.");
  command->add_option("--case", arguments->case_file, "case file (YAML)")->required();
  command->add_option("--out", arguments->out, "folder to fill; made if it is missing")->required();
  command->footer(
      "Example:\n"
      "  brainshift preview --case config/cases/colin27.yaml --out preview\n"
      "It takes seconds. Look at the pictures before every preparation: a tumour on the wrong "
      "side\n"
      "or gravity along the wrong axis is seen at once. Lines that begin with \"look again\" name\n"
      "what is unusual, and the key to look at. Exit status 2: the case cannot be prepared; what\n"
      "there is of it is drawn all the same.");
  command->callback([arguments, &status] { status = run_preview(*arguments); });
}

}  // namespace brainshift::client
