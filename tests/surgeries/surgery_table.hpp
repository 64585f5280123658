// SPDX-License-Identifier: GPL-3.0-or-later
// Rows of `surgeries`, picked and counted.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/benchmarks/csv_table.hpp"

namespace brainshift::surgeries {

// A choice of rows of one table, which must outlive it.
class Rows {
 public:
  explicit Rows(const bench::CsvTable& table);  // all of them

  std::size_t size() const { return rows_.size(); }
  bool empty() const { return rows_.empty(); }
  Rows where(std::string_view column, std::string_view text) const;
  Rows where(const std::function<bool(const Rows& all, std::size_t i)>& holds) const;
  // The row of the last update of every surgery.
  Rows last_updates() const;
  // Different texts of a column, in the order of the rows.
  std::vector<std::string> values(std::string_view column) const;

  const std::string& text(std::size_t i, std::string_view column) const;
  double number(std::size_t i, std::string_view column) const;
  // Numbers of a column, without those that are missing.
  std::vector<double> numbers(std::string_view column) const;
  // NaN when there is none.
  double mean(std::string_view column) const;
  double largest(std::string_view column) const;
  // Of rows for which a condition on a number holds; a missing number does not hold.
  int count(std::string_view column, const std::function<bool(double)>& holds) const;

 private:
  const bench::CsvTable* table_;
  std::vector<std::size_t> rows_;
};

}  // namespace brainshift::surgeries
