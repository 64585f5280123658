// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/evidence_truths.hpp"

namespace brainshift::evidence {

const std::vector<TruthKind>& truth_kinds() {
  static const std::vector<TruthKind> kinds = [] {
    std::vector<TruthKind> all = {{"consistency", {}}};
    for (const client::IngredientInfo& info : client::all_ingredients()) {
      all.push_back({info.name, {info.ingredient}});
    }
    all.push_back({"all", *client::ingredients_from("all")});
    all.push_back({"calculix", {}, true});
    return all;
  }();
  return kinds;
}

const TruthKind* find_truth(const std::string& name) {
  for (const TruthKind& kind : truth_kinds()) {
    if (kind.name == name) return &kind;
  }
  return nullptr;
}

}  // namespace brainshift::evidence
