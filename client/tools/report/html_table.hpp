// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of the page with a column per run, and the text of their numbers. Private to
// client/report.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/tools/report/head.hpp"
#include "common/core/statistics.hpp"

namespace brainshift::client {

// Text of reports and case files inside an HTML page: with &, <, >, " and ' replaced by their
// entities.
std::string escape_html(std::string_view text);

inline const std::string kNothing = "&ndash;";  // a value that there is not

// kNothing for a number that is absent or not finite.
std::string number(double value, int decimals);
std::string number(const std::optional<double>& value, int decimals);
std::string number(const std::optional<MeanStd>& value);  // mean and standard deviation
std::string plain(const std::string& text);               // escaped; kNothing when empty

// A row: its name, a cell for each run, then the paper's columns (contact, fixed, ICP) if wanted.
// Names and cells are HTML.
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
