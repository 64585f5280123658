// SPDX-License-Identifier: GPL-3.0-or-later
// BLAS threading policy.
#pragma once

namespace brainshift::linalg {

// Limits a threaded OpenBLAS to one thread. Its own threads make supernodal factorisation 3-30
// times slower on small or busy machines, and break bit-identical results. Does nothing with a
// serial BLAS. Factorisations and inverters call it themselves; a program may call it earlier.
void use_single_threaded_blas();

}  // namespace brainshift::linalg
