// SPDX-License-Identifier: GPL-3.0-or-later
// LoadDescent: the most probable loads of an update, with contact.
//
// For fixed loads z contact has one solution u(z) (contact_at_loads.hpp). The most probable z
// minimises
//
//   J(z) = min over c of 1/2 |R^-1/2 (d - A u(z) - common c)|^2 + 1/2 |V^-1/2 c|^2 + 1/2 |x|^2
//
// with z = S x, S the strengths of the prior's parts and V the common errors' variances. J is
// continuous and piecewise quadratic, one piece for each active set. The linear model of one set
// gives the second derivative H and the Newton step to its piece's minimum. The gradient of any
// other piece is cheap: by the adjoint, one solve with the compliance of its slaves. J is searched
// in two ways:
//
//   rough  From afar J looks smooth, with more or less curvature than its pieces have. Gradients
//          correct H as the search goes on (newton_steps.hpp), also those of trials that J did not
//          fall to. While the set changes much, the linear model is made anew instead.
//   fine   A minimum often lies on an edge between pieces, where no Newton step of any of them
//          falls. The pieces that the trials meet are gathered, and the next step is to the minimum
//          of their maximum (newton_steps.hpp).
//
// A rough step is shortened where contact would change in many slaves (ContactReach); how many
// are allowed grows with steps that fall and shrinks with others. A search for contact begins with
// the forces that the linear model predicts.
//
//   certificate   decrement: the length of the step that is left, in posterior standard deviations;
//                 J falls by half its square. violation: ContactAtLoads::violation_mm()
//
// The answer is z and what the mean over the hypotheses adds to the most probable one, with contact
// solved for it. That mean is one of linear models. Where hypotheses are so far apart that contact
// differs, it may lie where no hypothesis does and miss the data; then it is taken only as far as
// the linear model holds and the data allow.
#pragma once

#include <functional>
#include <stop_token>

#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/inversion/condensed/mode_posterior.hpp"
#include "common/inversion/condensed/newton_steps.hpp"
#include "common/inversion/condensed/sampled_operators.hpp"
#include "common/inversion/condensed/update_profile.hpp"
#include "common/inversion/skull/contact_at_loads.hpp"
#include "common/inversion/skull/contact_reduction.hpp"
#include "common/inversion/skull/contact_system.hpp"
#include "common/inversion/strengths/prior_strengths.hpp"
#include "common/linalg/growing_matrix.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::inversion {

// A decrement at which the search has converged.
inline constexpr double kDecrement = 1e-3;

// -log probability of the data that the mean over the hypotheses may cost.
inline constexpr double kLostByMean = 1.0;

// While strengths, weights or places of data may still change, a descent this close will do.
inline constexpr double kRoughDecrement = 0.2;

struct DescentLimits {
  int max_steps = 100;  // of one descent
  // Looked at before every step, every set of contact and every step of a search for strengths; the
  // second after steps instead of before them. By any thread.
  std::stop_token stop;
  std::function<bool()> out_of_time;
  std::function<void()> on_step;  // after every step, for the history

  bool over() const { return stop.stop_requested() || (out_of_time && out_of_time()); }
};

class LoadDescent {
 public:
  // Keeps references to operators, team and profile, to which it adds its stages. contact: false
  // keeps every slave open.
  LoadDescent(const CondensedOperators& operators, ModeWindow window, double beta, bool contact,
              ThreadTeam& team, UpdateProfile& profile);
  void reserve(int data) { posterior_.reserve(data); }
  // Makes what only sets of most slaves need (ReleasedSlaves).
  void prepare() { system_.prepare(); }
  // The next search begins without loads and contact.
  void forget();

  // New data: the linear model at the last z.
  Status take(SampledOperators& sampled);
  // The minimum of the present linear model, for posterior(); the loads stay where they are.
  Status minimise(const PriorStrengths& strengths);
  // To the minimum of the present linear model for strengths that are new, and the linear model
  // there. false when time is over: the loads stay. The first loads of an update are always found.
  Result<bool> jump(SampledOperators& sampled, const PriorStrengths& strengths,
                    const DescentLimits& limits = {});
  // Descends from z until decrement() is at most kDecrement (fine) or kRoughDecrement. Ends with
  // the linear model of the set at z: kConverged, kIterationLimit or kDeadline. Errors of the
  // members and stopped().
  Result<EstimateStatus> descend(SampledOperators& sampled, const PriorStrengths& strengths,
                                 bool fine, const DescentLimits& limits);
  // The mean over the hypotheses, which were weighed for the present linear model, and contact for
  // it. Nearer to the most probable loads where contact changes in many slaves on the way, or where
  // the mean would be less probable than those by more than kLostByMean for its misfit alone. false
  // when time is over: it is the most probable loads then.
  Result<bool> average(SampledOperators& sampled, PriorStrengths& strengths,
                       const DescentLimits& limits = {});
  // Its covariance.
  Status spread(PriorStrengths& strengths);

  // Where the last descend() ended.
  const VecX& most_probable() const { return z_; }
  // Of the last average().
  const VecX& z() const { return mean_z_; }
  // Lower factor of the covariance of z.
  const Eigen::MatrixXd& covariance_factor() const { return covariance_factor_; }
  double decrement() const { return decrement_; }
  const ContactAtLoads& contact() const { return contact_; }
  const ContactReduction& reduction() const { return reduction_; }
  ModePosterior& posterior() { return posterior_; }
  const ModePosterior& posterior() const { return posterior_; }

 private:
  // The linear model of the set that contact has at z_. same_data: as those of the last one.
  Status linearise(SampledOperators& sampled, bool same_data = true);
  Result<EstimateStatus> descend_smoothly(SampledOperators& sampled,
                                          const PriorStrengths& strengths, double tolerance,
                                          const DescentLimits& limits);
  Result<EstimateStatus> descend_to_edge(SampledOperators& sampled, const PriorStrengths& strengths,
                                         const DescentLimits& limits);
  // value_ and newton_ at z_, from the linear model there.
  Status begin(SampledOperators& sampled, const PriorStrengths& strengths);
  // Contact, after_ and next_ at trial_ = z_ + the step whose whitened image is given; false when
  // the limits are reached before.
  Result<bool> attempt(SampledOperators& sampled, const PriorStrengths& strengths,
                       const VecX& whitened, const DescentLimits& limits);
  bool far_from_model() const;
  int most_changes() const;
  // ContactReach::along(step_).
  double reach(const VecX& penetration, int most);
  // Contact at z, from the forces that the linear model predicts. false: give_up said so.
  Result<bool> solve_contact(const VecX& z, const std::function<bool()>& give_up = {});
  // The same at z_, unless contact_ is there already.
  Status return_contact();
  // trial_ becomes z_; contact_ is there already.
  void accept_trial();
  // The first sum of J at z, whose contact is solved, without the loads' own.
  double misfit(SampledOperators& sampled, const PriorStrengths& strengths, const VecX& z);
  // J at z, whose contact is solved. Precondition: z has no modes of absent parts.
  double objective(SampledOperators& sampled, const PriorStrengths& strengths, const VecX& z);
  // next_: the whitened Newton step at trial_ of the piece that its contact is on. Precondition:
  // objective(trial_) was the last one.
  Status newton_step(SampledOperators& sampled, const PriorStrengths& strengths);

  ModeWindow window_;
  ThreadTeam& team_;
  UpdateProfile& profile_;
  ContactSystem system_;
  ContactReduction reduction_;
  ContactAtLoads contact_;
  ContactReach reach_;
  ModePosterior posterior_;
  VecX z_, trial_, step_, gradient_, shift_, mean_z_;
  VecX predicted_;                                                   // forces, N
  VecX penetration_;                                                 // of every slave at z_, mm
  VecX newton_, next_, direction_, change_;                          // whitened
  double value_ = 0.0, after_ = 0.0;                                 // J at z_ and at trial_
  VecX whitened_, adjoint_, common_amplitudes_, right_, common_sd_;  // of the last objective()
  linalg::GrowingVector felt_;                                       // by the active slaves
  Eigen::MatrixXd normal_;
  QuasiNewton curvature_;
  NewtonBundle bundle_;
  Eigen::MatrixXd covariance_factor_;
  double decrement_ = 0.0;
  bool contact_at_z_ = false;  // else at a trial or at the mean
  bool contact_kept_ = false;  // contact_ has kept that of z_
  bool has_loads_ = false;     // z_ was found for the data of this update
};

}  // namespace brainshift::inversion
