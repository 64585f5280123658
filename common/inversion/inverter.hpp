// SPDX-License-Identifier: GPL-3.0-or-later
// Inverter: SparseData -> Estimate, again and again for one patient under one boundary condition,
// by one method. It holds what an update can reuse; invert() is the one-shot beside it.
//
// A session owns one and calls it from one thread. Not thread-safe, nor may two inverters over the
// same PreparedModel run at once: their solves share the factor's workspace.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/inversion/condensed/condensed_inverter.hpp"
#include "common/inversion/contract/inversion_options.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

class Inverter {
 public:
  virtual ~Inverter() = default;

  // Fills every member of `estimate`, its verdict too (contract/estimate_check.hpp), into memory
  // that it has already where the method can. After an unusable estimate the inverter is reset, so
  // that the next update does not start from it.
  // Errors: as check_data; kInvalidArgument for data outside the brain, which names the datum, and,
  // but for method condensed, for data along a direction; kNotFinite; kSingularMatrix; stopped()
  // when options.stop was requested, however little time a deadline had left. After an error the
  // estimate is not valid, and the next update works as if this one had not been tried.
  Status update(const SparseData& data, const InversionOptions& options, Estimate& estimate);
  // Forgets earlier updates: what follows is what a new inverter would give.
  virtual void reset() = 0;
  // What the last update may have lost by the parts that its scene leaves out; empty for the
  // methods that do not estimate it.
  virtual std::optional<OmissionErrors> omission_errors() const = 0;
  // Memory of what was prepared for it: operators, or factor, matrix and prior.
  virtual std::uint64_t bytes() const = 0;
  // How long the stages of the last update took; null for the methods that do not say.
  virtual const UpdateProfile* profile() const { return nullptr; }
  // What the last update left unknown; empty for the methods that do not compute it, and before an
  // update.
  virtual std::optional<PosteriorModes> posterior() const { return std::nullopt; }

 private:
  // What the method does: all of update() but the verdict.
  virtual Status invert(const SparseData& data, const InversionOptions& options,
                        Estimate& estimate) = 0;
};

// Method condensed, over operators that were prepared before surgery. Errors as
// CondensedInverter::build.
Result<std::unique_ptr<Inverter>> condensed_inverter(
    std::shared_ptr<const CondensedOperators> operators,
    std::shared_ptr<const geometry::TetLocator> locator, const CaseConfig& config,
    const CondensedOptions& options = {});

// Any method, over a factorised model. kCondensed condenses first: seconds on a toy, a
// minute on a head; the other methods take no time here. stop: of that preparation. Errors as
// condense().
Result<std::unique_ptr<Inverter>> make_inverter(std::shared_ptr<const PreparedModel> model,
                                                Method method, const std::stop_token& stop = {});

// invert(): SparseData -> Estimate once, by any method. Repeated inversions take an Inverter.

// Prepares for this one inversion and makes it. The price is the preparation: method kCondensed
// (the default) solves for every slave and many modes first, some thousand solves, which is seconds
// on a toy and a minute on a head. The model's own preparation is not
// repeated. options.stop ends the preparation too (kUnavailable).
//
// Errors as Inverter::update and make_inverter. The data are checked before anything is prepared
// (check_data: kInvalidArgument for fewer than 3 data, sizes that differ, sd <= 0, collinear
// positions; kNotFinite), their place afterwards: data outside the brain by more than 5 mm are
// kInvalidArgument, and the sentence names the datum.
Result<Estimate> invert(const PreparedModel& model, const SparseData& data,
                        Method method = Method::kCondensed, const InversionOptions& options = {});

}  // namespace brainshift::inversion
