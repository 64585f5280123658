// SPDX-License-Identifier: GPL-3.0-or-later
// A fuzz target: takes any bytes, and neither crashes, nor reads outside its memory, nor throws,
// nor breaks a property that it states with require().
//
// libFuzzer calls LLVMFuzzerTestOneInput (preset `fuzz`). In every other build replay.cpp calls it
// with the seeds and with the inputs of tests/fuzz/found, each once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace brainshift::fuzz {

// One input. Defined by each target.
void run(std::string_view bytes);

// Ends the process when a property does not hold.
inline void require(bool holds, const char* property) {
  if (holds) return;
  std::fprintf(stderr, "fuzz target: does not hold: %s\n", property);
  std::abort();
}

}  // namespace brainshift::fuzz

extern "C" inline __attribute__((used)) int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                                                   std::size_t size) {
  brainshift::fuzz::run({reinterpret_cast<const char*>(data), size});
  return 0;
}
