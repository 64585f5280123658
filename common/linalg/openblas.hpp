// SPDX-License-Identifier: GPL-3.0-or-later
// What a program asks of OpenBLAS: a kernel for its processor, and one thread.
#pragma once

#include <string>

namespace brainshift::linalg {

// The kernel that OpenBLAS has chosen, for example "Haswell"; "" with another BLAS.
std::string blas_kernel();

// OpenBLAS chooses its kernel by the model of the processor. One that is younger than the library
// gets the oldest kernel, Prescott (SSE3), whatever it can do (a product of 1,000 x 1,000 on a Xeon
// of model 207: 15 GFlop/s, with Haswell 40, with SkylakeX 67). This starts the program again, with
// OPENBLAS_CORETYPE set to the kernel for AVX2 or AVX-512, where that is so; otherwise it returns.
// OPENBLAS_CORETYPE is the user's choice where it is set. Call it first in main(): nothing may be
// open, running or written yet.
void choose_blas_kernel();

// Limits a threaded OpenBLAS to one thread. Its own threads make supernodal factorisation 3-30
// times slower on small or busy machines, and break bit-identical results. Does nothing with a
// serial BLAS. Factorisations and inverters call it themselves; a program may call it earlier.
void use_single_threaded_blas();

}  // namespace brainshift::linalg
