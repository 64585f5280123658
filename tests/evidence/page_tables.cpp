// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/page_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "tests/benchmarks/paired_test.hpp"
#include "tests/evidence/evidence_checks.hpp"

namespace brainshift::evidence {
namespace {

using bench::CsvTable;
using surgeries::Rows;

std::string cell(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string("–");
}

// Checks of one kind and bound. A check is called "SUBJECT: KIND"; its bound ends where a bracket
// begins.
struct Claim {
  std::string kind, bound;
  struct Value {
    std::string subject;
    double value = 0.0;
    bool pass = false;
  };
  std::vector<Value> values;
};

std::string without_bracket(const std::string& bound) { return bound.substr(0, bound.find(" (")); }

std::vector<Claim> claims_of(const CsvTable& checks, const std::string& study) {
  std::vector<Claim> claims;
  for (std::size_t row = 0; row < checks.rows(); ++row) {
    const std::string& pass = checks.text(row, "pass");
    if (pass.empty() || checks.text(row, "study") != study) continue;
    const std::string& name = checks.text(row, "name");
    const std::size_t colon = name.find(": ");
    const bool plain = colon == std::string::npos;
    const std::string kind = plain ? name : name.substr(colon + 2);
    const std::string bound = without_bracket(checks.text(row, "bound"));
    auto claim = std::find_if(claims.begin(), claims.end(), [&](const Claim& one) {
      return one.kind == kind && one.bound == bound;
    });
    if (claim == claims.end()) claim = claims.insert(claims.end(), {kind, bound, {}});
    claim->values.push_back(
        {plain ? "" : name.substr(0, colon), checks.number(row, "value"), pass == "1"});
  }
  return claims;
}

std::string value_text(const Claim::Value& value) { return fmt::format("{:.3g}", value.value); }

std::string named(const Claim::Value& value) {
  return value.subject.empty() ? value_text(value)
                               : fmt::format("{} (`{}`)", value_text(value), value.subject);
}

std::string measured(const Claim& claim) {
  const auto [least, most] =
      std::minmax_element(claim.values.begin(), claim.values.end(),
                          [](const auto& a, const auto& b) { return a.value < b.value; });
  if (claim.values.size() == 1) return named(*least);
  return named(*least) + " to " + named(*most);
}

std::string verdict(const Claim& claim) {
  std::string missed;
  int misses = 0;
  for (const Claim::Value& value : claim.values) {
    if (value.pass) continue;
    ++misses;
    missed += (missed.empty() ? "" : ", ") + named(value);
  }
  if (misses == 0) return "holds";
  return fmt::format("**missed** in {} of {}: {}", misses, claim.values.size(), missed);
}

}  // namespace

std::string claims_table(const CsvTable& checks, const std::string& study) {
  std::string text = "| figure | bound | measured | |\n|---|---|---|---|\n";
  for (const Claim& claim : claims_of(checks, study)) {
    text += fmt::format("| {} | {} | {} | {} |\n", claim.kind, claim.bound, measured(claim),
                        verdict(claim));
  }
  return text;
}

std::string truths_table(const Rows& rows) {
  std::string text =
      "| truth | tumour recovered, tumour alone: contact, fixed | with cortex: contact | error mm: "
      "estimate, rigid shift | CPPD mm, tumour alone: before, contact, fixed | with cortex | "
      "coverage: tumour alone, with cortex | *unusable*, contact |\n"
      "|---|---|---|---|---|---|---|---|\n";
  for (const std::string& truth : rows.values("truth")) {
    const Rows contact = rows.where("truth", truth).where("boundary", "contact");
    const Rows alone = contact.where("data", "tumour"),
               joint = contact.where("data", "tumour+cortex");
    const Rows fixed =
        rows.where("truth", truth).where("boundary", "fixed").where("data", "tumour");
    const auto mean = [](const Rows& of, const char* column, int digits) {
      return cell(patient_mean(of, column), digits);
    };
    text +=
        fmt::format("| `{}` | {}, {} % | {} % | {}, {} | {}, {}, {} | {} | {}, {} | {} of {} |\n",
                    truth, mean(alone, "recovered_pct", 1), mean(fixed, "recovered_pct", 1),
                    mean(joint, "recovered_pct", 1), mean(alone, "tumour_mm", 2),
                    mean(alone, "shift_tumour_mm", 2), mean(alone, "initial_cppd_mm", 2),
                    mean(alone, "cppd_mm", 2), mean(fixed, "cppd_mm", 2), mean(joint, "cppd_mm", 2),
                    mean(alone, "coverage_90", 2), mean(joint, "coverage_90", 2),
                    contact.where("quality", "unusable").size(), contact.size());
  }
  return text;
}

std::string landmarks_table(const CsvTable& landmarks) {
  const auto column = [&](const char* name) {
    std::vector<double> values;
    for (std::size_t row = 0; row < landmarks.rows(); ++row) {
      values.push_back(landmarks.number(row, name));
    }
    return values;
  };
  const auto rms = [](const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += value * value;
    return std::sqrt(sum / static_cast<double>(values.size()));
  };
  const std::vector<double> estimate = column("estimate_mm");
  std::string text = "| | rms distance | p against the estimate |\n|---|---|---|\n";
  for (const auto& [name, file_name] : {std::pair{"no correction", "none_mm"},
                                        {"rigid", "rigid_mm"},
                                        {"affine", "affine_mm"},
                                        {"thin-plate spline", "thin_plate_mm"}}) {
    const std::vector<double> other = column(file_name);
    text += fmt::format("| {} | {:.3f} mm | {:.2g} |\n", name, rms(other),
                        bench::paired_t_test(estimate, other).p);
  }
  return text + fmt::format("| **estimate** | {:.3f} mm | |\n", rms(estimate));
}

}  // namespace brainshift::evidence
