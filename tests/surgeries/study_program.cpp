// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/study_program.hpp"

#include <cstdio>
#include <cstdlib>

#include "common/core/exit_status.hpp"
#include "common/io/config/config_file.hpp"
#include "common/linalg/openblas.hpp"

namespace brainshift::surgeries {
namespace {

namespace fs = std::filesystem;

void find_external(fs::path& file, const fs::path& folder) {
  const char* external = std::getenv("BRAINSHIFT_EXTERNAL_DATA");
  if (file.empty() || external == nullptr || fs::exists(file)) return;
  const fs::path elsewhere = fs::path(external) / file.lexically_relative(folder);
  if (fs::exists(elsewhere)) file = elsewhere;
}

}  // namespace

void add_study_options(CLI::App& app, StudyArguments& arguments) {
  app.add_option("--first-seed", arguments.first_seed, "trials begin at 1001")
      ->capture_default_str();
  app.add_option("--thousand-nodes", arguments.thousand_nodes,
                 "size of the mesh; 18: the case's own edge length")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1000.0));
  app.add_option("--out", arguments.out, "table to write")->capture_default_str();
  app.add_flag("--resume", arguments.resume, "keep the surgeries that the table has");
}

Result<CaseConfig> read_head(const fs::path& path) {
  auto config = io::read_case_config(path);
  if (!config) return config;
  const fs::path folder = config->file.parent_path();
  find_external(config->mri, folder);
  find_external(config->brain, folder);
  return config;
}

int run_study(CLI::App& app, int argc, char** argv, const std::function<Status()>& run) {
  const std::string name = app.get_name();
  app.footer("Exit status: 0 measured, 1 failure, 2 bad usage or bad input.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::fprintf(stderr, "%s: %s (see %s --help)\n", name.c_str(), error.what(), name.c_str());
    return kExitBadInput;
  }
  linalg::use_single_threaded_blas();
  const Status ok = run();
  if (ok) return kExitSuccess;
  std::fprintf(stderr, "%s: %s\n", name.c_str(), ok.error().message.c_str());
  return exit_status(ok.error().code);
}

}  // namespace brainshift::surgeries
