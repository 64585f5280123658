// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of rows that are made by hand.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/benchmarks/csv_table.hpp"
#include "tests/replays/replay_rows.hpp"

namespace brainshift::replays {

using Texts = std::map<std::string, std::string>;

// One pass with updates of these latencies; every other stage takes a tenth of them. t_solve is 10.
inline std::vector<Texts> pass_of(const std::vector<double>& latencies_ms,
                                  const std::string& speed = "1x", const std::string& pass = "1") {
  std::vector<Texts> rows;
  for (const double latency : latencies_ms) {
    const std::string n = std::to_string(rows.size() + 1);
    Texts row = {
        {"head", "h"},       {"nodes", "100"},    {"kernel", "Any"},    {"surgery", "sag"},
        {"seed", "1"},       {"speed", speed},    {"pass", pass},       {"update", n},
        {"sequence", n},     {"source", "ius"},   {"outcome", "field"}, {"usual_ms", "10"},
        {"late", "0"},       {"quality", "good"}, {"deadline", "0"},    {"evidence", "ius " + n},
        {"t_solve_ms", "10"}};
    for (const char* stage : {"register", "invert", "rebuild", "encode", "journal"}) {
      row[std::string(stage) + "_ms"] = bench::csv_number(0.1 * latency);
    }
    row["latency_ms"] = bench::csv_number(latency);
    if (speed == "1x") row["sent_late_ms"] = "0.1";
    if (speed == "max") row["difference_mm"] = "0.001";
    rows.push_back(std::move(row));
  }
  return rows;
}

inline std::vector<Texts> joined(std::vector<Texts> a, const std::vector<Texts>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

inline bench::CsvTable table_of(const std::vector<Texts>& rows) {
  std::string text;
  const surgeries::Row columns = row_of({}, 0, {});
  for (const auto& [column, unused] : columns) text += column + ",";
  text.back() = '\n';
  for (const Texts& row : rows) {
    for (const auto& [column, unused] : columns) {
      const auto found = row.find(column);
      text += (found == row.end() ? "" : found->second) + ",";
    }
    text.back() = '\n';
  }
  return bench::CsvTable::parse(text, "table").value();
}

}  // namespace brainshift::replays
