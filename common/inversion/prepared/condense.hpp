// SPDX-License-Identifier: GPL-3.0-or-later
// PreparedModel -> CondensedOperators: the long work before surgery, blocked multi-right-hand-side
// solves.
//
// Right-hand sides are solved in blocks that are dealt to the cores in a fixed partition
// (contact_columns.hpp), one BLAS thread each, so the result is bit-identical from run to run.
//   1. load modes K^-1 M
//   2. for each residual field g of the prior, with one set of test vectors: sketch
//      F = K^-1 Sigma_g K^-1 Omega; Omega^T F = V Lambda V^T; U_g = F V Lambda^-1/2, leading
//      columns
//   3. diag(C_g) at the control nodes: |Sigma_g^1/2 K^-1 e|^2 by one more solve per control dof
//   4. G = K^-1 N block by block; Phi from the same blocks (contact_columns.hpp)
//   5. [U G] made small (encode_columns.hpp)
// With a store on disk G is in memory by blocks only; and the sketches of step 2 are gone by then.
//
// By several processes (PreparedModel::ranks) each has its own columns in the steps 1 to 4, and its
// own node blocks in step 5. The result is whole in the first process; the others lack `responses`.
#pragma once

#include <cstdint>
#include <stop_token>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/inversion/prepared/contact_columns.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

// Steps of compact columns (docs/decisions/0028): of the greatest number of G and of U. An extreme
// field is a sum of modes with factors of hundreds, which cancel; they are few, and finer.
inline constexpr float kContactStep = 1.0F / 8388608;  // 2^-23
inline constexpr float kModeStep = 1.0F / 33554432;    // 2^-25

struct CondenseOptions {
  Progress progress;     // stages "load modes", "prior modes", "far modes", "uncertainty",
                         // "contact columns", "compact columns"
  std::stop_token stop;  // checked between blocks
  BlockStore store;      // keeps nothing: G stays in memory
  int threads = 0;       // 0: as many as cores
};

// Within condensed.memory_limit_gib (within_memory). kInvalidArgument when that is too little
// (the sentence names both), and when the case's prior allows no motion at all or ten times as much
// as a skull does (the sentence has the figure); kUnavailable when stopped; kNotFinite; errors of
// the store.
Result<CondensedOperators> condense(const PreparedModel& model,
                                    const CondenseOptions& options = {});
// The same; frees the model, whose factor is as large as all else, before step 5.
Result<CondensedOperators> condense(PreparedModel&& model, const CondenseOptions& options = {});

struct CondenseSizes {
  int nodes = 0, slaves = 0, region = 0, modes = 0, threads = 1, ranks = 1;
  std::uint64_t model_bytes = 0;  // PrepareTimings::bytes
  bool model_stays = true;        // during step 5
  bool columns_in_memory = true;
  int block = BlockRunner::kBlock;   // columns that a thread solves together
  bool one_field_at_a_time = false;  // the residual fields' modes: half as many solves more
};
// Peak memory of condense() and of its model, bytes; of the first process where there are several.
std::uint64_t condense_memory_bytes(const CondenseSizes& sizes);
// With as much saved as `limit_bytes` needs: first the residual fields one after the other, which
// changes no number, then smaller blocks, down to 24 columns. By several processes nothing.
CondenseSizes within_memory(CondenseSizes sizes, std::uint64_t limit_bytes);

// The largest standard deviation of a node's motion under the prior, mm: root of the sum over its
// components.
double largest_motion_sd_mm(const CondensedOperators& operators);

}  // namespace brainshift::inversion
