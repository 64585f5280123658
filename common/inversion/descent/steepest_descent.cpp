// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/descent/steepest_descent.hpp"

#include "common/inversion/descent/descent_log.hpp"
#include "common/inversion/descent/misfit.hpp"
#include "common/inversion/descent/objective.hpp"

namespace brainshift::inversion {

Result<Estimate> steepest_descent(const PreparedModel& model, const SparseData& data,
                                  const InversionOptions& options,
                                  contact::PenalisedSystem& system) {
  DescentLog log(model.config().inversion, options, data);
  const auto misfit = Misfit::build(model, data);
  if (!misfit) return tl::unexpected(misfit.error());

  Points w = Points::Zero(3, model.model().mesh.num_nodes());
  Points b = w;
  Points u;
  Points lambda;
  Points dw;
  Points z;
  while (true) {
    if (auto s = log.check_stop(); !s) return tl::unexpected(s.error());
    if (auto s = system.solve_with_gaps(b, u); !s) return tl::unexpected(s.error());
    if (auto s = system.follow_contact(b, u); !s) return tl::unexpected(s.error());
    const Points e = misfit->residual(u);
    if (log.record(u, e, system)) break;

    if (auto s = negative_gradient(system, *misfit, e, w, lambda, dw); !s) {
      return tl::unexpected(s.error());
    }
    const Points s = model.prior().apply(dw);
    if (auto status = system.solve(s, z); !status) return tl::unexpected(status.error());
    const auto alpha = exact_step(*misfit, e, misfit->sample(z), b, s, dw);
    if (!alpha) return tl::unexpected(alpha.error());
    if (*alpha == 0.0) {
      log.at_minimum();
      break;
    }
    w += *alpha * dw;
    b += *alpha * s;
  }
  return log.finish();
}

}  // namespace brainshift::inversion
