// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/blas_threads.hpp"

#include <dlfcn.h>

namespace brainshift::linalg {

namespace {

void set_one_thread() {
  // Looked up at run time, because which BLAS is loaded is the system's choice, not the linker's.
  using SetThreads = void (*)(int);
  if (void* symbol = dlsym(RTLD_DEFAULT, "openblas_set_num_threads")) {
    reinterpret_cast<SetThreads>(symbol)(1);
  }
}

}  // namespace

void use_single_threaded_blas() {
  static const bool once = (set_one_thread(), true);
  (void)once;
}

}  // namespace brainshift::linalg
