// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the reports of replays to one folder: report.json (all runs), report.html and pictures.
#pragma once

#include <filesystem>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"

namespace brainshift::client {

struct ReportOptions {
  std::vector<std::filesystem::path> reports;  // report.json files
  std::filesystem::path out;                   // folder, made if missing
};

// Runs that name a field file and a case file get slices; a file that is named must exist.
// kNotFound, kUnreadable: a file or key, named; kInvalidArgument: a
// case file that has changed since the run; kEmptySet: the reports
// hold no run at all; kWriteFailed. Each file is complete or absent.
Status write_report(const ReportOptions& options, const Progress& progress = {});

}  // namespace brainshift::client
