// SPDX-License-Identifier: GPL-3.0-or-later
// A descent method by its name, with the system of equations that belongs to it.
//
//   kPaper                steepest descent       refactorises for every new active set
//   kPaperWoodbury        steepest descent       contact as a low-rank correction of the factor
//   kIterativeSolver      conjugate gradients    solves by preconditioned conjugate gradients
#pragma once

#include "common/core/error.hpp"
#include "common/inversion/contract/inversion_options.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/values/sparse_data.hpp"

namespace brainshift::inversion {

// Precondition: check_data(data) and check_whole(data) are ok. Errors of the method; kInternal for
// a method that is not in the table.
Result<Estimate> descend(const PreparedModel& model, Method method, const SparseData& data,
                         const InversionOptions& options);

}  // namespace brainshift::inversion
