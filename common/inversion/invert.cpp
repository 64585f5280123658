// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/invert.hpp"

#include "common/inversion/condensed_exact.hpp"
#include "common/inversion/data_check.hpp"
#include "common/inversion/steepest_descent.hpp"

namespace brainshift::inversion {
namespace {

// Prepares for one inversion; repeated ones take the class.
Result<Estimate> condensed_exact(const PreparedModel& model, const SparseData& data,
                                 const InversionOptions& options) {
  CondensedExactOptions exact;
  exact.stop = options.stop;
  auto inverter = CondensedExact::prepare(model, exact);
  if (!inverter) return tl::unexpected(inverter.error());
  Estimate estimate;
  if (auto status = inverter->update(data, estimate, options.stop); !status) {
    return tl::unexpected(status.error());
  }
  return estimate;
}

}  // namespace

Result<Estimate> invert(const PreparedModel& model, const SparseData& data,
                        const InversionOptions& options) {
  if (auto status = check_data(data); !status) return tl::unexpected(status.error());
  switch (options.method) {
    case Method::kPaper: return steepest_descent(model, data, options);
    case Method::kCondensedExact: return condensed_exact(model, data, options);
    case Method::kPaperWoodbury:
    case Method::kConjugateGradients:
    case Method::kIterativeSolver:
    case Method::kCondensed: break;
  }
  return fail(ErrorCode::kInternal, "unknown inversion method");
}

}  // namespace brainshift::inversion
