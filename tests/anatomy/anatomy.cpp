// SPDX-License-Identifier: GPL-3.0-or-later
// anatomy: whether the anatomy of a label map pays. Surgeries on one head with truths from outside
// (tests/surgeries/outside), each estimated by the model with falx, tentorium and ventricles and by
// the model of the same case without; a row of a table per update (head_pair.hpp).
//
// Kinds: air on one side and sag beside a falx, and ventricles that drain, in a head with anatomy;
// and sag of a head without, where anatomy must not harm.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "common/core/stopwatch.hpp"
#include "common/linalg/openblas.hpp"
#include "tests/anatomy/head_pair.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::anatomy_study {
namespace {

struct Arguments : surgeries::StudyArguments {
  std::filesystem::path head;
  int seeds = 20;
  std::vector<std::string> kinds;
};

Status run(const Arguments& arguments) {
  const auto config = surgeries::read_head(arguments.head);
  if (!config) return tl::unexpected(config.error());
  if (!config->anatomy.labels) {
    return invalid("case " + config->case_id + ": anatomy.labels is not there");
  }
  auto rows =
      surgeries::RowFile::open(arguments.out, refused_row({}, ""), kAnatomyKey, arguments.resume);
  if (!rows) return tl::unexpected(rows.error());
  std::unique_ptr<HeadPair> pair;
  for (int i = 0; i < arguments.seeds; ++i) {
    for (const StudyKind& kind : study_kinds()) {
      const auto& wanted = arguments.kinds;
      if (!wanted.empty() &&
          std::find(wanted.begin(), wanted.end(), kind.kind->name) == wanted.end()) {
        continue;
      }
      const AnatomyKey key{config->case_id, kind.kind->name,
                           arguments.first_seed + static_cast<std::uint64_t>(i)};
      if (rows->has(key.texts())) continue;
      Stopwatch watch;
      if (!pair) {
        auto made = HeadPair::make(*config, arguments.thousand_nodes);
        if (!made) return tl::unexpected(made.error());
        pair = std::move(*made);
        std::fprintf(stderr, "%s: %s; %.0f s\n", key.head.c_str(), pair->told().c_str(),
                     watch.seconds());
        watch = Stopwatch();
      }
      const auto played = pair->play(key);
      if (!played) return fail(played.error().code, key.kind + ": " + played.error().message);
      if (Status ok = rows->append(*played); !ok) return ok;
      const auto text = [&](const char* column) {
        return surgeries::text_of(played->back(), column);
      };
      std::fprintf(stderr,
                   "  seed %llu %-17s field %s with anatomy, %s without, of %s mm; coverage near "
                   "%s, %s; ventricles %s of %s mm3; %.1f s%s\n",
                   static_cast<unsigned long long>(key.seed), key.kind.c_str(),
                   text("with_field_mm").c_str(), text("without_field_mm").c_str(),
                   text("true_mm").c_str(), text("with_near_coverage_90").c_str(),
                   text("without_near_coverage_90").c_str(),
                   text("with_ventricle_change_mm3").c_str(), text("true_change_mm3").c_str(),
                   watch.seconds(), text("reason").c_str());
    }
  }
  return {};
}

}  // namespace
}  // namespace brainshift::anatomy_study

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::anatomy_study::Arguments arguments;
  CLI::App app{"The same surgeries estimated with and without the anatomy of a label map.",
               "anatomy"};
  app.add_option("--head", arguments.head, "case file with anatomy.labels")->required();
  app.add_option("--seeds", arguments.seeds, "surgeries per kind")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000));
  app.add_option("--kinds", arguments.kinds, "names, separated by commas; default: all")
      ->delimiter(',')
      ->check([](const std::string& name) {
        return brainshift::anatomy_study::find_study_kind(name) ? "" : name + " is unknown";
      });
  brainshift::surgeries::add_study_options(app, arguments);
  return brainshift::surgeries::run_study(
      app, argc, argv, [&] { return brainshift::anatomy_study::run(arguments); });
}
