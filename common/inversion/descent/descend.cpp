// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/descent/descend.hpp"

#include "common/contact/iterative_system.hpp"
#include "common/contact/refactorised_system.hpp"
#include "common/contact/woodbury_system.hpp"
#include "common/inversion/descent/conjugate_gradients.hpp"
#include "common/inversion/descent/steepest_descent.hpp"

namespace brainshift::inversion {

Result<Estimate> descend(const PreparedModel& model, Method method, const SparseData& data,
                         const InversionOptions& options) {
  switch (method) {
    case Method::kPaper: {
      contact::RefactorisedSystem system(model.forward());
      return steepest_descent(model, data, options, system);
    }
    case Method::kPaperWoodbury: {
      contact::WoodburySystem system(model.forward());
      return steepest_descent(model, data, options, system);
    }
    case Method::kIterativeSolver: {
      const auto system = contact::IterativeSystem::build(model.forward());
      if (!system) return tl::unexpected(system.error());
      return conjugate_gradients(model, data, options, **system);
    }
    case Method::kCondensed: break;
  }
  return fail(ErrorCode::kInternal,
              "method " + std::string(to_string(method)) + " is not a descent method");
}

}  // namespace brainshift::inversion
