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

// Calls patient::prepare_model, writes the model file, prints a table or one JSON object to stdout.
// A model that cannot be solved is not written. An interrupted run leaves OUT.partial, from which
// the next one goes on. Returns the exit status.
int run_prepare(const PrepareArguments& arguments);

}  // namespace brainshift::server
