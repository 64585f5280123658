// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/invert.hpp"

#include "common/inversion/data_check.hpp"
#include "common/inversion/steepest_descent.hpp"

namespace brainshift::inversion {

Result<Estimate> invert(const PreparedModel& model, const SparseData& data,
                        const InversionOptions& options) {
  if (auto status = check_data(data); !status) return tl::unexpected(status.error());
  switch (options.method) {
    case Method::kPaper: return steepest_descent(model, data, options);
    case Method::kPaperWoodbury:
    case Method::kConjugateGradients:
    case Method::kIterativeSolver:
    case Method::kCondensed:
    case Method::kCondensedExact: break;
  }
  return fail(ErrorCode::kInternal, "unknown inversion method");
}

}  // namespace brainshift::inversion
