// SPDX-License-Identifier: GPL-3.0-or-later
// The truths of the study: consistency, each adverse ingredient alone, all of them, and another
// code's.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/twin/adverse.hpp"
#include "client/tools/twin/surgery.hpp"
#include "common/core/error.hpp"
#include "tests/benchmarks/bench_head.hpp"
#include "tests/surgeries/played_brain.hpp"

namespace brainshift::evidence {

inline constexpr int kPatients = 5;  // of the paper; patient N has the case and scenario patient-N

struct TruthKind {
  std::string name;  // "consistency", "mesh", ..., "all", "calculix"
  client::Ingredients ingredients;
  bool calculix = false;  // the displacement is one that CalculiX found (calculix.hpp)
};

// In this order.
const std::vector<TruthKind>& truth_kinds();
const TruthKind* find_truth(const std::string& name);  // nullptr when unknown

// Twin of one patient: its true brains, the surgeries that are played on them, and what a rigid
// shift of the tumour makes of the same data.
struct PlayedSurgery {
  // Absent: the truth does nothing on this patient, or its fields are not of this head.
  std::optional<client::SimulatedSurgery> surgery;
  std::string reason;  // why it is absent, a sentence
  // Mean error at the tumour of the translation that brings the measured boundary onto the tumour's
  // surface. NaN where no boundary was measured.
  double shift_tumour_mm = 0.0;
};

class PatientTwin {
 public:
  // head: must outlive it. calculix: folder of another code's fields.
  PatientTwin(const bench::Head& head, int patient, std::filesystem::path calculix)
      : head_(head), patient_(patient), calculix_(std::move(calculix)) {}

  // The scenario of the patient's own motion under this truth. Errors: of with_ingredients, of the
  // true brain, of reading fields and of play_scenario but for kInvalidArgument.
  Result<PlayedSurgery> play(const TruthKind& truth, std::uint64_t seed);
  // Any scenario on this patient's head. Errors: as above.
  Result<PlayedSurgery> play(const client::Scenario& scenario, std::uint64_t seed);

 private:
  Result<surgeries::PlayedBrain*> brain_of(const client::Scenario& scenario, std::uint64_t seed);
  Result<client::SimulatedSurgery> play_calculix(const surgeries::PlayedBrain& played,
                                                 client::Scenario scenario, std::uint64_t seed);
  Result<PlayedSurgery> finish(Result<client::SimulatedSurgery> surgery) const;

  const bench::Head& head_;
  int patient_;
  std::filesystem::path calculix_;
  std::optional<BrainModel> anew_;
  // Those that no seed changes are kept, one for each mesh; of the others the latest.
  std::map<bool, std::unique_ptr<surgeries::PlayedBrain>> kept_;
  std::unique_ptr<surgeries::PlayedBrain> latest_;
};

}  // namespace brainshift::evidence
