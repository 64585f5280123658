// SPDX-License-Identifier: GPL-3.0-or-later
// SettledLoads: the most probable loads of an update, once four things that depend on one another
// have settled (condensed_inverter.hpp): loads with contact, strengths of the prior's parts, robust
// weights of the data, and places of data that follow the deformation.
//
//   begin     data sampled; outliers distrusted under the case's own strengths; first strengths
//   round     mean over the hypotheses -> weights and places for it -> descent -> strengths again
//
// Descents are rough while anything else changes. Once nothing does, one goes to the end (fine); if
// its round changes nothing either, all is settled. After kMaxRounds the data stay where they are:
// one more descent to the end, and the outcome is kIterationLimit.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/thread_team.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/inversion/condensed/field_rebuild.hpp"
#include "common/inversion/condensed/load_descent.hpp"
#include "common/inversion/condensed/robust_weights.hpp"
#include "common/inversion/condensed/sampled_operators.hpp"
#include "common/inversion/condensed/update_profile.hpp"
#include "common/inversion/contract/inversion_options.hpp"
#include "common/inversion/strengths/prior_strengths.hpp"

namespace brainshift::inversion {

class SettledLoads {
 public:
  // Keeps references to team, rebuild and profile. contact: false keeps every slave open.
  SettledLoads(const std::shared_ptr<const CondensedOperators>& operators,
               std::shared_ptr<const geometry::TetLocator> locator, ModeWindow window,
               const CaseConfig& config, bool contact, ThreadTeam& team, FieldRebuild& rebuild,
               UpdateProfile& profile);
  // Grows what depends on the number of data; nothing happens while they fit.
  void reserve(int data);

  // Checks data that are new and finds their places. Loads, contact and weights of earlier data are
  // forgotten. The data must live until the next call. Errors of check_data and of
  // SampledOperators::locate.
  Status take(const SparseData& data);
  // Settles all four. Errors of LoadDescent and PriorStrengths, and of moving data that do not fit.
  // on_answer: called after each mean over the hypotheses that a closer one will follow; from there
  // spread() may be called, which changes no later number.
  Result<EstimateStatus> settle(const InversionOptions& asked, const DescentLimits& limits,
                                const std::function<Status()>& on_answer = {});
  // Covariance of the last mean.
  Status spread() { return descent_.spread(strengths_); }

  // The data where they are now.
  const SparseData& data() const { return *data_; }
  SampledOperators& sampled() { return sampled_; }
  const PriorStrengths& strengths() const { return strengths_; }
  PriorStrengths& strengths() { return strengths_; }
  LoadDescent& descent() { return descent_; }
  const RobustWeights& weights() const { return weights_; }
  // Strengths of the remainders, squared, of the mean over the hypotheses.
  RemainderVariances remainder_variances() const;

 private:
  enum class Depth {
    kRough,  // more was to come
    kFine,   // to the end, while weights, places and strengths stayed
    kLast,   // to the end, although they did not stay: the rounds are used up
  };
  struct Round {
    int number = 0;
    Depth depth = Depth::kRough;                          // of the last descent
    EstimateStatus outcome = EstimateStatus::kConverged;  // of the last descent; in the end, of all
    const std::function<Status()>* on_answer = nullptr;
  };

  Status begin(const DescentLimits& limits, EstimateStatus& outcome);
  // One round; whether it was the last.
  Result<bool> go_round(const InversionOptions& asked, const DescentLimits& limits, Round& round);
  // A descent as deep as the round asks for, and strengths for where it ends.
  Status descend(const DescentLimits& limits, Round& round);

  // Checks and places data that are new or have moved.
  Status accept(const SparseData& data);
  // Samples the data and takes their linear model.
  Status sample();
  // Of the part that stands for the model's own error, in units of its standard deviation.
  void set_model_error_floor();
  bool set_model_error_floor_of_loads();
  void set_floor(double of_medium);
  // At the data, of the minimum of the linear model: upper quartile over the data, mm.
  double motion_of_part(PriorPart part);
  // Of the first `count` of norms_, which it orders anew.
  double upper_quartile(int count);
  Status distrust_outliers(const DescentLimits& limits);
  // PriorStrengths::fit and refit for the present linear model.
  Status fit(const DescentLimits& limits);
  Result<bool> refit(bool may_change, const DescentLimits& limits);
  // Strengths and rough descents in turn until the strengths stay.
  Status find_strengths(const DescentLimits& limits, EstimateStatus& outcome);
  // Weights and places of the data for the present estimate; whether anything changed.
  Result<bool> follow(const MovingData* moving);
  bool reweigh();
  Result<bool> relocate(const MovingData& moving);

  ThreadTeam& team_;
  FieldRebuild& rebuild_;
  UpdateProfile& profile_;
  SampledOperators sampled_;
  PriorStrengths strengths_;
  LoadDescent descent_;
  RobustWeights weights_;
  bool robust_;
  // Of a displacement component that the medium and the far remainder stand for.
  double medium_sd_mm_, far_sd_mm_;

  const SparseData* data_ = nullptr;        // the caller's, or moved_
  SparseData moved_;                        // the data where they are now, when they move
  std::vector<DataSource> sources_before_;  // of moved_, before they moved
  Points moving_displacement_;
  VecX norms_;                   // of the residuals, per datum
  RemainderVariances left_out_;  // what sampled_ knows
};

}  // namespace brainshift::inversion
