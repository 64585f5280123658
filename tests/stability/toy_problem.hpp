// SPDX-License-Identifier: GPL-3.0-or-later
// The toy patient of a sweep, prepared by the product, with its reference; and points that
// compare an answer with it.
#pragma once

#include <memory>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "tests/stability/reference_posterior.hpp"
#include "tests/stability/stability_point.hpp"

namespace brainshift::stability {

struct ToyProblem {
  std::shared_ptr<const BrainModel> brain;
  CaseConfig config;  // the product's
  std::shared_ptr<const inversion::PreparedModel> model;
  // As `model`, without the fault: loads and data are made with it.
  std::shared_ptr<const inversion::PreparedModel> truth;
  std::unique_ptr<ReferencePatient> patient;
  // The slaves that press most when the toy sinks by 8 mm and when it rises by 8 mm.
  std::vector<int> weighty_slaves;

  // Faults: sign    the gaps of the weighty slaves have the other sign
  //         normal  their contact normals are turned by 0.2 rad
  //         scale   the shear modulus is 10 % too large
  // Errors as CaseConfig's validate() and PreparedModel::prepare.
  static Result<ToyProblem> make(const CaseConfig& config, Fault fault, int cells = 5);
};

// The case of every sweep but where it says otherwise; all modes of the toy patient fit.
CaseConfig stability_config();

// Buoyancy that makes the free body sag; the largest displacement without contact is largest_mm.
Points sagging_load(const ToyProblem& problem, double largest_mm);

struct DataOptions {
  double largest_mm = 8.0;  // of the sagging truth without contact; negative: it rises
  double noise_mm = 0.1, sd_mm = 0.2;
  int count = 40;  // nodes of the data region
  std::uint64_t seed = 4;
};
// Displacements of a truth with contact; an error where that has no solution.
Result<SparseData> sagging_data(const ToyProblem& problem, const DataOptions& options);

// The bound of every inversion, mm: a hundredth of the gap and a twentieth of the misfit's
// standard deviation, below what surgery can see. It is what the reduced method promises.
inline constexpr double kInversionBound_mm = 0.01;
// What the product may leave to gain in ln p over the prior's scales: well within the 68 % region
// of their own posterior, whose edge is at 1.75, half the 0.68 quantile of chi-square with three
// degrees of freedom (along gravity, across it, other).
inline constexpr double kScalesBound = 1.0;

// One inversion from a cold start, compared with the reference.
//   condensed                     the posterior mean, by compare_with_posterior()
//   paper, paper-woodbury, pcg    the same descent in long double (reference_descent.hpp): field,
//                                 contact forces times the compliance of their slave, mean misfit
void invert_and_record(ToyProblem& problem, const SparseData& data, Method method, Point point,
                       const Options& options);

// Field and contact forces (times the compliance of their slave) against the posterior mean of
// the set that the reference finds by itself. Where that search finds none, or one with another
// posterior, against the posterior of the product's set, which must then fulfil contact in the
// reference. The reference objects when the prior's scales leave more than kScalesBound to gain.
void compare_with_posterior(ToyProblem& problem, const SparseData& data, const Estimate& estimate,
                            Point& point);

// u = K_p^-1 b_p with contact, against the same in long double. Bound: rounding_bound().
void solve_and_record(ToyProblem& problem, const Points& load, Point point, const Options& options);

// Relative error in the 2-norm that a backward stable solve may leave: 10 kappa_2 2^-53, at most
// a thousandth.
double rounding_bound(double condition);

}  // namespace brainshift::stability
