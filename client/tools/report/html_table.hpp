// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of the page with a column per run, and the text of their numbers. Private to
// client/report.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/tools/pictures/chart.hpp"
#include "client/tools/report/head.hpp"
#include "common/core/statistics.hpp"

namespace brainshift::client {

inline const std::string kNothing = "&ndash;";  // a value that there is not

// kNothing for a number that is absent or not finite.
std::string number(double value, int decimals);
std::string number(const std::optional<double>& value, int decimals);
std::string number(const std::optional<MeanStd>& value);  // mean and standard deviation
// "87 ms", "1.3 s", "4.3 min"
std::string duration(double ms);
std::string duration(const std::optional<double>& ms);
std::string plain(const std::string& text);  // escaped; kNothing when empty

bool has_truth(const std::vector<ReportedRun>& runs);  // of any
std::string shift_text(const TumourShift& shift);      // "2.3 +- 0.2", HTML
std::string quality_badge(const std::string& quality);

// A row: its name, a cell for each run, then the paper's columns (contact, fixed, ICP) if wanted. A
// row of which no run has a value is left out. Names and cells are HTML.
class Table {
 public:
  using Cell = std::function<std::string(const RunReport&)>;

  // Keeps a reference to the runs.
  Table(const std::vector<ReportedRun>& runs, bool with_paper);
  void row(const std::string& name, const Cell& cell, const std::vector<std::string>& paper = {});
  std::string finish() { return html_ + "</tbody></table></div>\n"; }

 private:
  const std::vector<ReportedRun>& runs_;
  bool with_paper_;
  std::string html_;
};

}  // namespace brainshift::client
