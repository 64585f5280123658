// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/surgery_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "common/core/statistics.hpp"

namespace brainshift::surgeries {
namespace {
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
}

Rows::Rows(const bench::CsvTable& table) : table_(&table), rows_(table.rows()) {
  std::iota(rows_.begin(), rows_.end(), std::size_t{0});
}

Rows Rows::where(std::string_view column, std::string_view text) const {
  return where([&](const Rows& all, std::size_t i) { return all.text(i, column) == text; });
}

Rows Rows::where(const std::function<bool(const Rows&, std::size_t)>& holds) const {
  Rows chosen = *this;
  chosen.rows_.clear();
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (holds(*this, i)) chosen.rows_.push_back(rows_[i]);
  }
  return chosen;
}

Rows Rows::last_updates() const {
  std::map<std::string, std::size_t> last;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    std::string key;
    for (const char* column : {"head", "place", "seed", "scenario"}) key += text(i, column) + ",";
    last[key] = rows_[i];
  }
  Rows chosen = *this;
  chosen.rows_.clear();
  for (const auto& [key, row] : last) chosen.rows_.push_back(row);
  std::sort(chosen.rows_.begin(), chosen.rows_.end());
  return chosen;
}

std::vector<std::string> Rows::values(std::string_view column) const {
  std::vector<std::string> all;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const std::string& one = text(i, column);
    if (std::find(all.begin(), all.end(), one) == all.end()) all.push_back(one);
  }
  return all;
}

const std::string& Rows::text(std::size_t i, std::string_view column) const {
  return table_->text(rows_[i], column);
}

double Rows::number(std::size_t i, std::string_view column) const {
  return table_->number(rows_[i], column);
}

std::vector<double> Rows::numbers(std::string_view column) const {
  std::vector<double> all;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const double value = number(i, column);
    if (std::isfinite(value)) all.push_back(value);
  }
  return all;
}

double Rows::mean(std::string_view column) const {
  const std::vector<double> all = numbers(column);
  return all.empty() ? kNaN : mean_std(all).mean;
}

double Rows::largest(std::string_view column) const {
  const std::vector<double> all = numbers(column);
  return all.empty() ? kNaN : *std::max_element(all.begin(), all.end());
}

int Rows::count(std::string_view column, const std::function<bool(double)>& holds) const {
  const std::vector<double> all = numbers(column);
  return static_cast<int>(std::count_if(all.begin(), all.end(), holds));
}

}  // namespace brainshift::surgeries
