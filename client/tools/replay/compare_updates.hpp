// SPDX-License-Identifier: GPL-3.0-or-later
// Whether two updates say the same.
#pragma once

#include <string>
#include <vector>

#include "common/wire/convert.hpp"

namespace brainshift::client {

enum class Agreement {
  kBitForBit,      // same build, machine type and BLAS kernel
  kWithinRounding  // anything else: fields within kRounding_mm and one step of a 32-bit float
};
// What other instructions do to the last digits of a field (docs/conventions.md). Fields travel as
// 32-bit floats, which may round to the neighbour.
inline constexpr double kRounding_mm = 1e-9;

struct UpdateComparison {
  std::vector<std::string> differences;  // one clause each; empty: the updates agree
  double displacement_mm = 0.0;          // greatest difference of a node's component
};

// Compares what was estimated and judged: error, status, quality, field, standard deviations,
// contact and, bit for bit, forces, misfits, alignment, strengths, sources and omissions too.
// Numbers, times and the omission of the journal belong to a session and are not compared.
UpdateComparison compare_updates(const UpdateMessage& recorded, const UpdateMessage& replayed,
                                 Agreement agreement);

}  // namespace brainshift::client
