// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/descent/descents.hpp"

#include <algorithm>
#include <utility>

#include "common/inversion/descent/descent_log.hpp"
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

namespace {

// dw and s = Sigma dw, each conjugate to the one before.
class Direction {
 public:
  const Points& dw() const { return dw_; }
  const Points& s() const { return s_; }

  // r: negative gradient.
  void update(const prior::ForcePrior& prior, const Points& r, bool restart) {
    Points sigma_r = prior.apply(r);
    const double norm2 = inner(r, sigma_r);
    double gamma = 0.0;
    if (!restart && norm2_ > 0.0) gamma = std::max(0.0, (norm2 - inner(r, sigma_r_)) / norm2_);
    if (gamma > 0.0) {
      dw_ = r + gamma * dw_;
      s_ = sigma_r + gamma * s_;
    } else {
      dw_ = r;
      s_ = sigma_r;
    }
    norm2_ = norm2;
    sigma_r_ = std::move(sigma_r);
  }

 private:
  Points dw_;
  Points s_;
  Points sigma_r_;
  double norm2_ = 0.0;  // r . Sigma r
};

}  // namespace

Result<Estimate> conjugate_gradients(const PreparedModel& model, const SparseData& data,
                                     const InversionOptions& options,
                                     contact::PenalisedSystem& system) {
  DescentLog log(model.config().inversion, options, data);
  const auto misfit = Misfit::build(model, data);
  if (!misfit) return tl::unexpected(misfit.error());

  Points w = Points::Zero(3, model.model().mesh.num_nodes());
  Points b = w;
  Points u;
  Points lambda;
  Points r;
  Points z;
  Direction direction;
  if (auto s = system.solve_with_gaps(b, u); !s) return tl::unexpected(s.error());
  while (true) {
    if (auto s = log.check_stop(); !s) return tl::unexpected(s.error());
    const auto changed = system.follow_contact(b, u);
    if (!changed) return tl::unexpected(changed.error());
    const Points e = misfit->residual(u);
    if (log.record(u, e, system)) break;

    if (auto s = negative_gradient(system, *misfit, e, w, lambda, r); !s) {
      return tl::unexpected(s.error());
    }
    direction.update(model.prior(), r, *changed);
    if (auto s = system.solve(direction.s(), z); !s) return tl::unexpected(s.error());
    const auto alpha = exact_step(*misfit, e, misfit->sample(z), b, direction.s(), direction.dw());
    if (!alpha) return tl::unexpected(alpha.error());
    if (*alpha == 0.0) {
      log.at_minimum();
      break;
    }
    w += *alpha * direction.dw();
    b += *alpha * direction.s();
    u += *alpha * z;
  }
  return log.finish();
}

}  // namespace brainshift::inversion
