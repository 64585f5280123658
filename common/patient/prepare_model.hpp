// SPDX-License-Identifier: GPL-3.0-or-later
// prepare_model(): everything that is done before surgery, CaseConfig -> ModelFile.
//
//   read       the files that the case names, and what they are told by later
//              (io/model/model_inputs.hpp)
//   build      mesh, surfaces, node sets (anatomy)
//   factorise  under each boundary condition, of smaller meshes under both at once; a model that
//              cannot be solved ends here
//   condense   the operators of each boundary condition; half a minute on a head
// With a checkpoint file, the contact columns survive an interruption and are not solved again.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/io/model/checkpoint_file.hpp"
#include "common/io/model/model_file.hpp"

namespace brainshift::patient {

// In the order of ModelFile::condensed.
inline constexpr std::array kPreparedBoundaries = {Boundary::kContact, Boundary::kFixed};

struct PrepareOptions {
  Progress progress;     // stages "read images", those of the builder, "contact: factor", ...
  std::stop_token stop;  // checked between the steps above and between blocks of columns
  // Holds the contact columns until they are made compact: 0.5 GiB for 18 thousand nodes, 8 GiB for
  // 94. Empty: they stay in memory, and an interrupted preparation starts afresh.
  std::filesystem::path checkpoint;
  // Called when the checkpoint holds blocks of an interrupted preparation; may be empty.
  std::function<void()> on_resume;
  // Threads that condense; 0: as many as cores.
  int threads = 0;
  // Processes that all call prepare_model() with the same case; each has a thread and a checkpoint
  // of its own, CHECKPOINT.RANK, from which nothing goes on. The first one's file is whole, the
  // others' operators lack the responses. nullptr: this process alone.
  Ranks* ranks = nullptr;
};

struct PreparedPatient {
  io::ModelFile file;
  std::vector<std::string> notes;  // of anatomy::build_brain_model
  double read_s = 0.0;
  double mesh_s = 0.0;
  std::array<inversion::PrepareTimings, kPreparedBoundaries.size()>
      timings;  // of the factorisations
  // For the caller to remove() once the model is safe on disk; empty without a checkpoint.
  std::optional<io::CheckpointFile> checkpoint;
};

// Errors: of io::record_inputs, io::load_case_inputs, anatomy::build_brain_model,
// PreparedModel::prepare and condense(), which name a key or file; of CheckpointFile; kUnavailable
// when stopped. An error leaves the blocks that are finished in the checkpoint. By several
// processes: all have the error of the first that has one; kInternal when their models differ.
Result<PreparedPatient> prepare_model(const CaseConfig& config, const PrepareOptions& options = {});

}  // namespace brainshift::patient
