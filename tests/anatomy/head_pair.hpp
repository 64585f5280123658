// SPDX-License-Identifier: GPL-3.0-or-later
// One head as two models know it: with falx, tentorium and ventricles of its label map, and
// without. Surgeries whose truths come from outside (tests/surgeries/outside), estimated by both.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tests/anatomy/common_places.hpp"
#include "tests/benchmarks/bench_head.hpp"
#include "tests/surgeries/outside/outside_truth.hpp"
#include "tests/surgeries/row_file.hpp"
#include "tests/surgeries/surgery_rows.hpp"

namespace brainshift::anatomy_study {

// What happens, and in which head: one with slits and cavities, or one without.
struct StudyKind {
  const outside::Kind* kind;
  bool anatomy;   // of the truth
  bool any_mesh;  // its load can be put on the mesh of any model of the head
};
// air-side, falx-sag and ventricles-drain of heads with anatomy; sag of a head without.
const std::vector<StudyKind>& study_kinds();
const StudyKind* find_study_kind(const std::string& name);  // nullptr when unknown

// The table: a row per update.
inline const std::vector<std::string> kAnatomyKey = {"head", "kind", "seed"};
struct AnatomyKey {
  std::string head, kind;
  std::uint64_t seed = 0;
  surgeries::RowFile::Key texts() const { return {head, kind, std::to_string(seed)}; }
};
// A row with the headings, and empty cells but for key and reason.
surgeries::Row refused_row(const AnatomyKey& key, const std::string& reason);

struct ModelScore;  // what one update of one model is worth

class HeadPair {
 public:
  // config: a case with anatomy.labels. Both models have meshes of their own of about this size; no
  // update of theirs is cut short by its deadline, so that results do not depend on the machine.
  // Errors of bench::make_head and of the truths' heads.
  static Result<std::unique_ptr<HeadPair>> make(CaseConfig config, double thousand_nodes);
  ~HeadPair();

  // All updates of one surgery. A kind that finds no equilibrium is a refused row. Errors of the
  // twin, of pipelines and of scoring.
  Result<std::vector<surgeries::Row>> play(const AnatomyKey& key);
  std::string told() const;  // sizes, one line

 private:
  HeadPair() = default;
  struct Model;  // a prepared head and its pipeline
  struct World;  // where truths happen, and how both models see it
  static Result<std::unique_ptr<Model>> model_of(const CaseConfig& config, double thousand_nodes);
  static Result<std::unique_ptr<World>> world_of(const Model& home, const Model& with,
                                                 const Model& without);
  // The truth as this model's instruments see it, and every update scored.
  static Result<std::vector<ModelScore>> estimates(const Model& model, const World& world,
                                                   bool anatomy, const StudyKind& kind,
                                                   const outside::OutsideTruth& truth,
                                                   std::uint64_t seed);

  std::unique_ptr<Model> with_, without_;
  std::unique_ptr<World> open_, plain_;  // with anatomy and without
};

}  // namespace brainshift::anatomy_study
