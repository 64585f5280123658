// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of the ablations made by hand.
#pragma once

#include <fmt/format.h>

#include <string>

#include "tests/benchmarks/csv_table.hpp"

namespace brainshift::ablations {

class MadeUpRows {
 public:
  // Craniotomy and brain have ten times the tumour's error.
  void add(const std::string& variant, const std::string& truth, const std::string& data, int seed,
           double tumour_mm, double coverage = 0.9) {
    text_ += fmt::format("h,1,{},{},{},{},converged,{},{},{},{},100\n", truth, seed, variant, data,
                         tumour_mm, 10.0 * tumour_mm, 10.0 * tumour_mm, coverage);
  }
  void add_refused(const std::string& variant, const std::string& truth, int seed) {
    text_ += fmt::format("h,1,{},{},{},tumour,refused,,,,,\n", truth, seed, variant);
  }
  bench::CsvTable table() const { return *bench::CsvTable::parse(text_, "rows"); }

 private:
  std::string text_ =
      "head,patient,truth,seed,variant,data,status,tumour_mm,cppd_mm,field_mm,coverage_90,nodes\n";
};

}  // namespace brainshift::ablations
