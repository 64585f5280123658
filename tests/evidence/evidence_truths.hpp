// SPDX-License-Identifier: GPL-3.0-or-later
// The truths of the study: consistency, each adverse ingredient alone, all of them, and another
// code's.
#pragma once

#include <string>
#include <vector>

#include "client/tools/twin/adverse.hpp"

namespace brainshift::evidence {

inline constexpr int kPatients = 5;  // of the paper; patient N has the case and scenario patient-N

struct TruthKind {
  std::string name;  // "consistency", "mesh", ..., "all", "calculix"
  client::Ingredients ingredients;
  bool calculix = false;  // the displacement is one that CalculiX found (calculix_truth.hpp)
};

// In this order.
const std::vector<TruthKind>& truth_kinds();
const TruthKind* find_truth(const std::string& name);  // nullptr when unknown

}  // namespace brainshift::evidence
