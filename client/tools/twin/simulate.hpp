// SPDX-License-Identifier: GPL-3.0-or-later
// Twin: simulated surgeries with known truth (paper section 2.6), recorded as surgery files.
//
// The truth is a forward solution of the case's own model with contact, under gravity, drainage
// down to the scenario's fluid level, and swelling. Every observation has a truth of its own. It
// goes to the truth tables of the surgery file, which only scoring reads. The observations carry
// what an operating room would measure.
//
// Without adverse ingredients (adverse.hpp) this is the consistency truth, an inverse crime as in
// the paper: truth and estimate share mesh and, unless the scenario varies the stiffness, material.
// The estimate does not know the load (fluid level, swelling), the contact state and the noise.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::client {

inline constexpr const char* kInstrumentsOfTruth = "joint-sag";

struct SimulateOptions {
  std::filesystem::path case_file;
  std::string scenario;         // with a truth: whose instruments look; empty: kInstrumentsOfTruth
  std::string adverse;          // "mesh,gap" or "all" (adverse.hpp); empty: none
  std::filesystem::path truth;  // empty: that of the scenario; else read_truth_field()
  std::uint64_t seed = 1;
  std::filesystem::path out;  // must not exist; nothing is left behind on failure
};

// A displacement, mm, of every node of the model's mesh: the point array `displacement` of a .vtu,
// as `brainshift journal export` writes it. kInvalidArgument, with file and key: points of another
// mesh, no such array, a value that is not finite. Errors of io::read_vtu.
inline constexpr double kSameNode_mm = 0.001;  // farther apart: a node of another mesh
Result<Points> read_truth_field(const std::filesystem::path& path, const BrainModel& model);

// The surgery file calls the scenario NAME, or NAME+INGREDIENT+... or NAME+all, or NAME+truth.
// kNotFound for an unknown scenario or ingredient; the sentence lists the known ones.
// kInvalidArgument when an ingredient does nothing (truth_load.hpp), or stands beside a truth, or
// `out` exists. kWriteFailed when it cannot be written. Other errors: of reading the case, building
// its model, read_truth_field and play_scenario.
Status simulate(const SimulateOptions& options, const Progress& progress = {});

// What a surgery file says of a simulated surgery of this model, made now by `software`. The case
// file is named by its full path.
io::SurgeryMeta simulated_meta(const BrainModel& model, const std::filesystem::path& case_file,
                               const std::string& scenario, std::uint64_t seed,
                               const std::string& software);

}  // namespace brainshift::client
