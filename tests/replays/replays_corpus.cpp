// SPDX-License-Identifier: GPL-3.0-or-later
// replays_corpus: makes the corpus (corpus.hpp) of one head, NAME.surgery each, and corpus.csv with
// what it holds (corpus.hpp), in a folder that has none of them yet.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "client/tools/twin/simulate.hpp"
#include "common/core/stopwatch.hpp"
#include "common/linalg/openblas.hpp"
#include "common/patient/read_patient.hpp"
#include "tests/replays/corpus.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::replays {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path head = BRAINSHIFT_DEFAULT_CASE;
  fs::path folder = ".";
};

Status make(const patient::Patient& patient, const CorpusSurgery& surgery,
            const Arguments& arguments, std::vector<ManifestEntry>& manifest) {
  const Stopwatch watch;
  const auto played =
      client::play_scenario(patient.model, patient.config, surgery.scenario, surgery.seed);
  if (!played) return tl::unexpected(played.error());
  const io::SurgeryMeta meta = client::simulated_meta(patient.model, arguments.head, surgery.name,
                                                      surgery.seed, "brainshift replays_corpus");
  const auto recording = record(*played, surgery.scenario.fluid_levels_mm.size());
  const fs::path file = arguments.folder / (surgery.name + ".surgery");
  if (Status ok = write_recording(file, meta, recording); !ok) return ok;
  for (const auto& recorded : recording) {
    manifest.push_back(entry_of(surgery.name, surgery.seed, recorded));
  }
  std::fprintf(stderr, "  %s: %zu observations in %.1f s; %.1f s\n", surgery.name.c_str(),
               recording.size(), 1e-9 * static_cast<double>(recording.back().recorded_ns),
               watch.seconds());
  return {};
}

Status run(const Arguments& arguments) {
  const auto config = surgeries::read_head(arguments.head);
  if (!config) return tl::unexpected(config.error());
  auto model = patient::build_patient(*config);
  if (!model) return tl::unexpected(model.error());
  const patient::Patient patient{*config, std::move(*model)};
  std::vector<ManifestEntry> manifest;
  for (const CorpusSurgery& surgery : corpus()) {
    if (Status ok = make(patient, surgery, arguments, manifest); !ok) {
      return fail(ok.error().code, surgery.name + ": " + ok.error().message);
    }
  }
  return write_manifest(arguments.folder / "corpus.csv", manifest);
}

}  // namespace
}  // namespace brainshift::replays

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::replays::Arguments arguments;
  CLI::App app{"The surgeries that `make replays` plays.", "replays_corpus"};
  app.add_option("--head", arguments.head, "case file of the head")->capture_default_str();
  app.add_option("--out", arguments.folder, "folder for the surgeries")
      ->capture_default_str()
      ->check(CLI::ExistingDirectory);
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::replays::run(arguments); });
}
