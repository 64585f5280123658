// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/invert.hpp"

#include "common/inversion/conjugate_gradients.hpp"
#include "common/inversion/data_check.hpp"
#include "common/inversion/iterative_system.hpp"
#include "common/inversion/refactorised_system.hpp"
#include "common/inversion/steepest_descent.hpp"
#include "common/inversion/woodbury_system.hpp"

namespace brainshift::inversion {
namespace {

Result<Estimate> paper(const PreparedModel& model, const SparseData& data,
                       const InversionOptions& options) {
  RefactorisedSystem system(model.forward());
  return steepest_descent(model, data, options, system);
}

Result<Estimate> paper_woodbury(const PreparedModel& model, const SparseData& data,
                                const InversionOptions& options) {
  WoodburySystem system(model.forward());
  return steepest_descent(model, data, options, system);
}

Result<Estimate> gradients_woodbury(const PreparedModel& model, const SparseData& data,
                                    const InversionOptions& options) {
  WoodburySystem system(model.forward());
  return conjugate_gradients(model, data, options, system);
}

Result<Estimate> gradients_iterative(const PreparedModel& model, const SparseData& data,
                                     const InversionOptions& options) {
  const auto system = IterativeSystem::build(model.forward());
  if (!system) return tl::unexpected(system.error());
  return conjugate_gradients(model, data, options, **system);
}

}  // namespace

Result<Estimate> invert(const PreparedModel& model, const SparseData& data,
                        const InversionOptions& options) {
  if (auto status = check_data(data); !status) return tl::unexpected(status.error());
  switch (options.method) {
    case Method::kPaper: return paper(model, data, options);
    case Method::kPaperWoodbury: return paper_woodbury(model, data, options);
    case Method::kConjugateGradients: return gradients_woodbury(model, data, options);
    case Method::kIterativeSolver: return gradients_iterative(model, data, options);
    case Method::kCondensed:
    case Method::kCondensedExact: break;
  }
  return fail(ErrorCode::kInternal, "unknown inversion method");
}

}  // namespace brainshift::inversion
