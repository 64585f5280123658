// SPDX-License-Identifier: GPL-3.0-or-later
// brainshiftd prepare: case file -> model file, before surgery.
#pragma once

#include <filesystem>

namespace brainshift::server {

struct PrepareArguments {
  std::filesystem::path case_file;
  std::filesystem::path out;
  bool json = false;
};

// Builds the brain model, prepares it under both boundaries (a model that cannot be solved is refused and
// not written), writes it, prints a table or one JSON object to stdout. Returns the exit status.
int run_prepare(const PrepareArguments& arguments);

}  // namespace brainshift::server
