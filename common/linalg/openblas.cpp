// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/openblas.hpp"

#include <dlfcn.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <vector>

namespace brainshift::linalg {
namespace {

// nullptr when the processor needs no newer kernel than Prescott.
const char* newest_kernel() {
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return nullptr;
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&
                      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
                      __builtin_cpu_supports("avx512vl");
  return avx512 ? "SkylakeX" : "Haswell";
}

void set_one_thread() {
  // Looked up at run time, because which BLAS is loaded is the system's choice, not the linker's.
  using SetThreads = void (*)(int);
  if (void* symbol = dlsym(RTLD_DEFAULT, "openblas_set_num_threads")) {
    reinterpret_cast<SetThreads>(symbol)(1);
  }
}

}  // namespace

std::string blas_kernel() {
  // Looked up at run time, because which BLAS is loaded is the system's choice, not the linker's.
  using Name = const char* (*)();
  void* symbol = dlsym(RTLD_DEFAULT, "openblas_get_corename");
  return symbol != nullptr ? reinterpret_cast<Name>(symbol)() : "";
}

void choose_blas_kernel() {
  constexpr const char* kVariable = "OPENBLAS_CORETYPE";
  if (std::getenv(kVariable) != nullptr || blas_kernel() != "Prescott") return;
  const char* kernel = newest_kernel();
  if (kernel == nullptr) return;
  std::vector<std::string> words;
  std::ifstream command("/proc/self/cmdline", std::ios::binary);
  for (std::string word; std::getline(command, word, '\0');) words.push_back(word);
  if (words.empty() || setenv(kVariable, kernel, 1) != 0) return;
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  execv("/proc/self/exe", arguments.data());
  unsetenv(kVariable);  // it could not be started again, and goes on as it is
}

void use_single_threaded_blas() {
  static const bool once = (set_one_thread(), true);
  (void)once;
}

}  // namespace brainshift::linalg
