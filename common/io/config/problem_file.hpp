// SPDX-License-Identifier: GPL-3.0-or-later
// Problem files (docs/solve.md) to values. A message is one line:
// "FILE:LINE: KEY = VALUE: must be ...".
#pragma once

#include <filesystem>
#include <string>

#include "common/configuration/problem_spec.hpp"
#include "common/core/error.hpp"

namespace brainshift::io {

// Reads and validates; unknown keys are errors. Relative paths are taken from the file's folder.
// Whether the files that it names exist is for their readers to say.
Result<ProblemSpec> read_problem(const std::filesystem::path& path);
Result<ProblemSpec> parse_problem(const std::string& text, const std::filesystem::path& file);

// Puts file and line in front of a message that begins with a key: what was wrong with a problem
// that could be read.
Error locate_in_problem(const std::filesystem::path& path, const Error& error);

}  // namespace brainshift::io
