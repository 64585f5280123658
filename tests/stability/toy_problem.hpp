// SPDX-License-Identifier: GPL-3.0-or-later
// The toy patient of a sweep, prepared, with its reference; and points that compare an answer with it.
#pragma once

#include <memory>
#include <optional>

#include "common/values/case_config.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "tests/stability/reference.hpp"
#include "tests/stability/stability_point.hpp"

namespace brainshift::stability {

struct ToyProblem {
  std::shared_ptr<const BrainModel> brain;
  CaseConfig config;
  std::unique_ptr<const inversion::PreparedModel> model;
  std::unique_ptr<Reference> reference;
  VecX slave_compliance;  // Phi_ii, mm/N: turns a force into a length

  // Errors as CaseConfig's validate() and PreparedModel::prepare.
  static Result<ToyProblem> make(const CaseConfig& config, int cells = 5);
};

// The case of every sweep but where it says otherwise; all modes of the toy patient fit.
CaseConfig stability_config();

// Buoyancy that makes the free body sag; the largest displacement without contact is largest_mm.
Points sagging_load(const ToyProblem& problem, double largest_mm);

struct DataOptions {
  double largest_mm = 8.0;  // of the sagging truth without contact; negative: it rises
  double noise_mm = 0.1;
  double sd_mm = 0.2;
  int count = 40;  // nodes of the data region
  std::uint64_t seed = 4;
};
// Displacements of a truth with contact; an error where that has no solution.
Result<SparseData> sagging_data(const ToyProblem& problem, const DataOptions& options);

// The bound of every inversion, mm: a hundredth of the gap and a twentieth of the misfit's standard deviation, below
// what surgery can see; it is what the reduced method promises.
inline constexpr double kInversionBound_mm = 0.01;

// One inversion from a cold start, compared with the posterior of its own active set: the field, the contact forces
// (times the compliance of their slave) and, where contact is said to hold, the contact conditions.
// condensed, condensed-exact: the posterior. paper and cg: stop by the misfit and promise no posterior; what they report
// of their misfit is recomputed instead.
void invert_and_record(ToyProblem& problem, const SparseData& data, Method method, Point point,
                       const Options& options);
// The comparison alone, for a given answer.
void compare_with_posterior(ToyProblem& problem, const SparseData& data, const Estimate& estimate,
                            Point& point);

// u = K_p^-1 b_p with contact, against the same in long double. Bound: rounding_bound().
void solve_and_record(ToyProblem& problem, const Points& load, Point point, const Options& options);

// Relative error in the 2-norm that a backward stable solve may leave: 10 kappa_2 2^-53, at most a thousandth.
double rounding_bound(double condition);

}  // namespace brainshift::stability
