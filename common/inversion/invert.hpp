// SPDX-License-Identifier: GPL-3.0-or-later
// invert(): SparseData -> Estimate once, by any method. Repeated inversions take an Inverter.
#pragma once

#include "common/core/error.hpp"
#include "common/inversion/contract/inversion_options.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/values/estimate.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

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
