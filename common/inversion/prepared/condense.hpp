// SPDX-License-Identifier: GPL-3.0-or-later
// PreparedModel -> CondensedOperators: the long work before surgery, blocked multi-right-hand-side
// solves.
//
// Right-hand sides are solved in blocks of kBlock columns, blocks dealt to the cores in a fixed
// partition, one BLAS thread each, so the result is bit-identical from run to run. Only G (float),
// the sketch (3n x q, double) and two blocks per core are held at a time.
//   1. G = K^-1 N block by block; Phi from the same blocks
//   2. for each remainder g of the prior, with one set of test vectors: sketch F = K^-1 Sigma_g
//      K^-1 Omega; Omega^T F = V Lambda V^T; U_g = F V Lambda^-1/2, leading columns
//   3. load modes K^-1 M
//   4. diag(C_g) at the control nodes: |Sigma_g^1/2 K^-1 e|^2 by one more solve per control dof
//   5. [U G] made small (encode_columns.hpp)
#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/operators/condensed_operators.hpp"

namespace brainshift::inversion {

// Keeps finished blocks of contact columns, so that an interrupted preparation can go on. Called by
// one thread at a time.
struct BlockStore {
  // Fills both arrays, which have the shape of the block; false when block `index` is not kept.
  std::function<bool(int index, Eigen::MatrixXf& columns, Eigen::MatrixXd& compliance)> load;
  std::function<void(int index, const Eigen::MatrixXf& columns, const Eigen::MatrixXd& compliance)>
      save;
};

// Steps of compact columns (docs/decisions/0028): of the greatest number of G and of U. An extreme
// field is a sum of modes with factors of hundreds, which cancel; they are few, and finer.
inline constexpr float kContactStep = 1.0F / 8388608;  // 2^-23
inline constexpr float kModeStep = 1.0F / 33554432;    // 2^-25

struct CondenseOptions {
  Progress progress;     // stages "contact columns", "prior modes", "load modes", "uncertainty",
                         // "compact columns"
  std::stop_token stop;  // checked between blocks
  BlockStore store;      // both empty: nothing is kept
  int threads = 0;       // 0: as many as cores
};

// kInvalidArgument when condensed.memory_limit_gib is below the factor and condense_memory_bytes
// (the sentence names both), and when the case's prior allows no motion at all or ten times as much
// as a skull does (the sentence has the figure); kUnavailable when stopped; kNotFinite.
Result<CondensedOperators> condense(const PreparedModel& model,
                                    const CondenseOptions& options = {});

// Peak memory of the arrays of condense(), bytes.
std::uint64_t condense_memory_bytes(int nodes, int slaves, const CaseConfig& config, int threads);

// The largest standard deviation of a node's motion under the prior, mm: root of the sum over its
// components.
double largest_motion_sd_mm(const CondensedOperators& operators);

}  // namespace brainshift::inversion
