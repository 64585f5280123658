// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/html_table.hpp"

#include <fmt/format.h>

#include <cmath>

namespace brainshift::client {

std::string number(double value, int decimals) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, decimals) : kNothing;
}

std::string number(const std::optional<double>& value, int decimals) {
  return value ? number(*value, decimals) : kNothing;
}

std::string number(const std::optional<MeanStd>& value) {
  if (!value) return kNothing;
  return number(value->mean, 2) + "&nbsp;&plusmn;&nbsp;" + number(value->std, 2);
}

std::string plain(const std::string& text) { return text.empty() ? kNothing : escape_html(text); }

Table::Table(const std::vector<ReportedRun>& runs, bool with_paper)
    : runs_(runs), with_paper_(with_paper) {
  html_ = "<div class=\"scroll\"><table>\n<thead><tr><th></th>";
  for (const ReportedRun& run : runs) {
    html_ += "<th>" + escape_html(run.report.scenario) + "<br>" + escape_html(run.report.method) +
             "<br>" + escape_html(run.report.boundary) + "</th>";
  }
  if (with_paper) {
    for (const char* name : {"contact", "fixed", "ICP, contact"}) {
      html_ += std::string("<th class=\"paper\">Ji et al.<br>") + name + "</th>";
    }
  }
  html_ += "</tr></thead>\n<tbody>\n";
}

void Table::row(const std::string& name, const Cell& cell, const std::vector<std::string>& paper) {
  std::string cells;
  bool any = false;
  for (const ReportedRun& run : runs_) {
    const std::string text = cell(run.report);
    any = any || text != kNothing;
    cells += "<td>" + text + "</td>";
  }
  if (!any) return;
  html_ += "<tr><th>" + name + "</th>" + cells;
  for (std::size_t i = 0; with_paper_ && i < 3; ++i) {
    html_ += "<td class=\"paper\">" + (i < paper.size() ? paper[i] : "") + "</td>";
  }
  html_ += "</tr>\n";
}

std::string duration(double ms) {
  if (!std::isfinite(ms)) return kNothing;
  if (ms < 10.0) return fmt::format("{:.1f} ms", ms);
  if (ms < 999.5) return fmt::format("{:.0f} ms", ms);
  if (ms < 59950.0) return fmt::format("{:.1f} s", 1e-3 * ms);
  if (ms < 60.0 * 59950.0) return fmt::format("{:.1f} min", ms / 60000.0);
  return fmt::format("{:.1f} h", ms / 3600000.0);
}

std::string duration(const std::optional<double>& ms) { return ms ? duration(*ms) : kNothing; }

}  // namespace brainshift::client
