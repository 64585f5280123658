// SPDX-License-Identifier: GPL-3.0-or-later
// CondensedExact: the condensed inversion with the whole prior in double precision, the judge of
// the reduced one (condensed_inverter.hpp).
//
// Outputs y = H u of the data region and the slaves, Phi = H K^-1 H^T, Psi = H C H^T
// (output_operators.hpp). T: data, A: active slaves. For a set A, with D = Phi_AA + I / beta
// (penalty contact, paper eq. 16):
//   contact seen by data      Z = A Phi_TA D^-1,   B = [A, -Z]
//   posterior                 (B Psi B^T + R) mu = d - Z p_A
//   free body                 y_free = Psi B^T mu
//   contact forces            D f = p_A - y_free,A
//   outputs                   y = y_free + Phi_:A f
// and the next set as contact/set_search.hpp chooses it, by single pivots in a cycle (Murty 1974).
// For the final set two solves rebuild the field:
//   u = K^-1 (Sigma K^-1 H^T B^T mu + N_A f)
// This is the posterior mean of the paper's penalised system K_p for that set, up to rounding. No
// standard deviation is computed: sd_mm stays empty. An update has no deadline: it is for
// comparison.
//
// Not thread-safe, nor may the model be used by another thread meanwhile.
#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/inversion/contract/inversion_options.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

struct CondensedExactOptions {
  Progress progress;     // of build(): stages of output_operators()
  std::stop_token stop;  // of build(), checked between blocks of columns
  bool warm_start = true;
  int threads = 0;  // 0: as many as cores
};

class CondensedExact {
 public:
  // Errors as output_operators(). Keeps a reference to the model.
  static Result<CondensedExact> build(const PreparedModel& model,
                                      const CondensedExactOptions& options = {});
  CondensedExact(CondensedExact&&) noexcept;
  CondensedExact& operator=(CondensedExact&&) noexcept;
  ~CondensedExact();

  // Writes every member of `estimate`. asked.stop: looked at before every contact set.
  // Errors as check_data and check_whole; kInvalidArgument for data outside the brain or outside
  // the data region (the sentence names the datum); stopped(); kSingularMatrix; kNotFinite. An
  // error leaves `estimate` as it was.
  Status update(const SparseData& data, Estimate& estimate, const InversionOptions& asked = {});
  // Forgets the last active set.
  void reset();
  // Memory of Phi and Psi.
  std::uint64_t bytes() const;

 private:
  struct Impl;
  explicit CondensedExact(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::inversion
