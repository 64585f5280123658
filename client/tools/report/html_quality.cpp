// SPDX-License-Identifier: GPL-3.0-or-later
// Whether the fields of each run could be used: a column per run, a row per verdict, flag and part
// of the prior. A verdict is told by word, sign and frame, so that no reader depends on colours.
#include <algorithm>
#include <cstdio>
#include <set>

#include "client/tools/report/escape_html.hpp"
#include "client/tools/report/html_page.hpp"
#include "client/tools/report/html_table.hpp"

namespace brainshift::client {
namespace {

// At most this many hypotheses of a run are shown; the report holds all.
constexpr std::size_t kMostHypotheses = 3;

std::string badge(const std::string& verdict) {
  const char* sign = "?";
  if (verdict == to_string(Quality::kGood)) sign = "&#10003;";
  if (verdict == to_string(Quality::kCaution)) sign = "&#9651;";
  if (verdict == to_string(Quality::kUnusable)) sign = "&#10005;";
  const std::string name = escape_html(verdict);
  return "<span class=\"verdict " + name + "\">" + sign + " " + name + "</span>";
}

Table::Cell of_quality(std::string (*text)(const RunQuality&)) {
  return [text](const RunReport& run) { return run.quality ? text(*run.quality) : kNothing; };
}

std::string counts(const RunQuality& quality) {
  const QualityCounts& counts = quality.counts;
  std::string text = std::to_string(counts.good) + " / " + std::to_string(counts.caution) + " / " +
                     std::to_string(counts.unusable);
  if (counts.not_judged > 0) text += " (" + std::to_string(counts.not_judged) + " not judged)";
  return text;
}

// The flags that any run has, in the order of the verdict's bits; then those of newer writers.
std::vector<std::string> flags_of(const std::vector<ReportedRun>& runs) {
  std::set<std::string> seen;
  for (const ReportedRun& run : runs) {
    if (!run.report.quality) continue;
    for (const auto& [flag, count] : run.report.quality->flags) seen.insert(flag);
  }
  std::vector<std::string> flags;
  for (const QualityFlag flag : kAllQualityFlags) {
    if (seen.erase(std::string(to_string(flag))) > 0) flags.emplace_back(to_string(flag));
  }
  flags.insert(flags.end(), seen.begin(), seen.end());
  return flags;
}

std::string words_for(const std::string& flag) {
  for (const QualityFlag known : kAllQualityFlags) {
    if (flag == to_string(known)) return escape_html(sentence(known));
  }
  return escape_html(flag);
}

void add_flag_rows(const std::vector<ReportedRun>& runs, Table& table) {
  for (const std::string& flag : flags_of(runs)) {
    table.row("updates where " + words_for(flag) + " <code>" + escape_html(flag) + "</code>",
              [&flag](const RunReport& run) -> std::string {
                if (!run.quality) return kNothing;
                const auto found = run.quality->flags.find(flag);
                return std::to_string(found == run.quality->flags.end() ? 0 : found->second);
              });
  }
}

std::vector<std::string> parts_of(const std::vector<ReportedRun>& runs) {
  std::vector<std::string> parts;
  for (const ReportedRun& run : runs) {
    for (const PartStrength& strength : run.report.prior_strengths) {
      if (std::find(parts.begin(), parts.end(), strength.part) == parts.end()) {
        parts.push_back(strength.part);
      }
    }
  }
  return parts;
}

std::string strength_text(const RunReport& run, const std::string& part) {
  for (const PartStrength& strength : run.prior_strengths) {
    if (strength.part != part) continue;
    std::string text = number(strength.mean, 2);
    if (strength.absent > 0.0) text += " (absent: " + number(100.0 * strength.absent, 0) + " %)";
    if (strength.at_bound) text += ", at its bound";
    return text;
  }
  return kNothing;
}

std::string hypothesis_text(const WeightedStrengths& hypothesis) {
  std::string parts;
  for (const auto& [part, scale] : hypothesis.scales) {
    if (scale == 0.0) continue;
    parts += (parts.empty() ? "" : ", ") + escape_html(part) + "&nbsp;" + number(scale, 2);
  }
  return number(100.0 * hypothesis.weight, 0) + " %: " + (parts.empty() ? "nothing" : parts);
}

std::string hypotheses_text(const RunReport& run) {
  std::string text;
  for (std::size_t i = 0; i < std::min(kMostHypotheses, run.hypotheses.size()); ++i) {
    text += (i == 0 ? "" : "<br>") + hypothesis_text(run.hypotheses[i]);
  }
  return text.empty() ? kNothing : text;
}

}  // namespace

std::string quality_table(const std::vector<ReportedRun>& runs) {
  Table table(runs, false);
  table.row("worst update", of_quality([](const RunQuality& q) { return badge(q.worst); }));
  table.row("last update", of_quality([](const RunQuality& q) { return badge(q.last); }));
  table.row("reason given with the last update", of_quality([](const RunQuality& q) {
              return "<span class=\"words\">" + plain(q.reason) + "</span>";
            }));
  table.row("updates: good / with caution / unusable", of_quality(counts));
  add_flag_rows(runs, table);
  for (const std::string& part : parts_of(runs)) {
    table.row("strength of the prior: " + escape_html(part),
              [&part](const RunReport& run) { return strength_text(run, part); });
  }
  const bool any = std::any_of(runs.begin(), runs.end(), [](const ReportedRun& run) {
    return !run.report.hypotheses.empty();
  });
  if (any) table.row("most probable strengths", hypotheses_text);
  return table.finish();
}

}  // namespace brainshift::client
