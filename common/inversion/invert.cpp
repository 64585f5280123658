// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/invert.hpp"

#include "common/inversion/condensed/condensed_exact.hpp"
#include "common/inversion/descent/conjugate_gradients.hpp"
#include "common/inversion/contract/data_check.hpp"
#include "common/inversion/contract/estimate_check.hpp"
#include "common/contact/iterative_system.hpp"
#include "common/contact/refactorised_system.hpp"
#include "common/inversion/descent/steepest_descent.hpp"
#include "common/contact/woodbury_system.hpp"

namespace brainshift::inversion {
namespace {

Result<Estimate> paper(const PreparedModel& model, const SparseData& data,
                       const InversionOptions& options) {
  contact::RefactorisedSystem system(model.forward());
  return steepest_descent(model, data, options, system);
}

Result<Estimate> paper_woodbury(const PreparedModel& model, const SparseData& data,
                                const InversionOptions& options) {
  contact::WoodburySystem system(model.forward());
  return steepest_descent(model, data, options, system);
}

Result<Estimate> gradients_woodbury(const PreparedModel& model, const SparseData& data,
                                    const InversionOptions& options) {
  contact::WoodburySystem system(model.forward());
  return conjugate_gradients(model, data, options, system);
}

Result<Estimate> gradients_iterative(const PreparedModel& model, const SparseData& data,
                                     const InversionOptions& options) {
  const auto system = contact::IterativeSystem::build(model.forward());
  if (!system) return tl::unexpected(system.error());
  return conjugate_gradients(model, data, options, **system);
}

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

Result<Estimate> run(const PreparedModel& model, const SparseData& data,
                     const InversionOptions& options) {
  switch (options.method) {
    case Method::kPaper: return paper(model, data, options);
    case Method::kPaperWoodbury: return paper_woodbury(model, data, options);
    case Method::kConjugateGradients: return gradients_woodbury(model, data, options);
    case Method::kIterativeSolver: return gradients_iterative(model, data, options);
    case Method::kCondensedExact: return condensed_exact(model, data, options);
    case Method::kCondensed: break;
  }
  return fail(ErrorCode::kInternal, "unknown inversion method");
}

}  // namespace

Result<Estimate> invert(const PreparedModel& model, const SparseData& data,
                        const InversionOptions& options) {
  if (auto status = check_data(data); !status) return tl::unexpected(status.error());
  if (auto status = check_whole(data); !status) return tl::unexpected(status.error());
  auto estimate = run(model, data, options);
  if (!estimate || options.method == Method::kCondensedExact) return estimate;  // checks itself
  if (auto status = check_estimate(model, *estimate); !status) {
    return tl::unexpected(status.error());
  }
  return estimate;
}

}  // namespace brainshift::inversion
