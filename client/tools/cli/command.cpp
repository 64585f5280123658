// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/cli/command.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <utility>

#include "client/tools/monitor/keys.hpp"
#include "common/core/text.hpp"

namespace brainshift::client {

void add_key_options(CLI::App& command, KeyOptions& options) {
  command.add_option("--server-key", options.server_key,
                     "the daemon's public key, a file; for daemons that ask for keys");
  command.add_option("--key", options.key, "own secret key, a file (see brainshift keys --help)");
}

Status read_keys(const KeyOptions& options, std::optional<ClientKeys>& keys) {
  auto read = client_keys(options.server_key, options.key);
  if (!read) return tl::unexpected(read.error());
  keys = std::move(*read);
  return {};
}

void print_line(const std::string& line) {
  std::puts(line.c_str());
  std::fflush(stdout);
}

void print_lines(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) print_line(one_line(line, '?'));
}

void print_wrote(const std::filesystem::path& path, const std::string& more) {
  print_line("wrote " + one_line(path.string() + more, '?'));
}

void print_error(std::string_view sentence) {
  std::fprintf(stderr, "brainshift: %s\n", one_line(sentence).c_str());
}

Progress terminal_progress() {
  if (::isatty(STDERR_FILENO) == 0) return {};
  // The stage on the line now; empty when the line is free.
  auto shown = std::make_shared<std::string>();
  return [shown](std::string_view stage, double fraction) {
    if (!shown->empty() && *shown != stage) std::fputc('\n', stderr);
    *shown = stage;
    std::fprintf(stderr, "\r\033[K%-32.*s %3.0f %%", static_cast<int>(stage.size()), stage.data(),
                 100.0 * fraction);
    if (fraction >= 1.0) {
      std::fputc('\n', stderr);
      shown->clear();
    }
    std::fflush(stderr);
  };
}

}  // namespace brainshift::client
