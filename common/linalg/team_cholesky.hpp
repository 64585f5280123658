// SPDX-License-Identifier: GPL-3.0-or-later
// The Cholesky factor of a dense matrix, with the work shared by a ThreadTeam.
#pragma once

#include "common/core/thread_team.hpp"
#include "common/linalg/blas.hpp"

namespace brainshift::linalg {

// Lower triangle of A -> L with L L^T = A, in place; false when A is not positive definite. The
// upper triangle may be overwritten. In blocks (Golub & Van Loan 2013, Matrix Computations, 4.2.9:
// outer products), each computed by one member and the same whatever their number is, so that the
// result does not depend on the team. Does not allocate.
[[nodiscard]] bool cholesky(blas::Out<double> a, ThreadTeam& team);

}  // namespace brainshift::linalg
