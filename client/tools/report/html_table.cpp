// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/html_table.hpp"

#include <fmt/format.h>

#include <cmath>

namespace brainshift::client {

std::string escape_html(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&': escaped += "&amp;"; break;
      case '<': escaped += "&lt;"; break;
      case '>': escaped += "&gt;"; break;
      case '"': escaped += "&quot;"; break;
      case '\'': escaped += "&#39;"; break;
      default: escaped += c;
    }
  }
  return escaped;
}

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
  html_ += "<tr><th>" + name + "</th>";
  for (const ReportedRun& run : runs_) html_ += "<td>" + cell(run.report) + "</td>";
  for (std::size_t i = 0; with_paper_ && i < 3; ++i) {
    html_ += "<td class=\"paper\">" +
             (i < paper.size() && !paper[i].empty() ? paper[i] : kNothing) + "</td>";
  }
  html_ += "</tr>\n";
}

}  // namespace brainshift::client
