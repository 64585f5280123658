// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/html_page.hpp"

#include <algorithm>
#include <functional>
#include <optional>

#include "client/tools/report/html_table.hpp"
#include "client/tools/report/paper_values.hpp"

namespace brainshift::client {
namespace {

using Chosen = std::vector<const RunReport*>;
using Value = std::function<std::optional<double>(const RunReport&)>;

Chosen chosen(const std::vector<ReportedRun>& runs) {
  const auto those = [&](const std::function<bool(const RunReport&)>& holds) {
    Chosen some;
    for (const ReportedRun& run : runs) {
      if (holds(run.report)) some.push_back(&run.report);
    }
    return some;
  };
  const auto contact = [](const RunReport& r) { return r.boundary == "contact"; };
  Chosen some = those([&](const RunReport& r) { return contact(r) && r.method == "condensed"; });
  if (some.empty()) some = those(contact);
  if (some.empty()) some = those([](const RunReport&) { return true; });
  return some;
}

// "97.7", or "92.2 to 97.7"; empty when no run has the value.
std::string range(const Chosen& runs, const Value& value, int decimals) {
  std::optional<double> least, most;
  for (const RunReport* run : runs) {
    const std::optional<double> one = value(*run);
    if (!one) continue;
    least = least ? std::min(*least, *one) : *one;
    most = most ? std::max(*most, *one) : *one;
  }
  if (!least) return "";
  const std::string from = number(*least, decimals), to = number(*most, decimals);
  return from == to ? from : from + " to " + to;
}

std::optional<double> latency(const RunReport& run) {
  return run.latency_ms ? std::optional(run.latency_ms->p50) : std::nullopt;
}

std::optional<double> solves(const RunReport& run) {
  if (!run.latency_ms || !run.full_solve_ms || !(*run.full_solve_ms > 0.0)) return std::nullopt;
  return run.latency_ms->p50 / *run.full_solve_ms;
}

const RunReport* least_recovered(const Chosen& runs) {
  const RunReport* least = nullptr;
  for (const RunReport* run : runs) {
    if (!run->recovery_pct) continue;
    if (least == nullptr || *run->recovery_pct < *least->recovery_pct) least = run;
  }
  return least;
}

std::string recovered(const Chosen& runs) {
  const RunReport* least = least_recovered(runs);
  if (least == nullptr)
    return "made updates whose errors are unknown, because no truth was recorded";
  std::string text = "recovered " +
                     range(
                         runs, [](const RunReport& r) { return r.recovery_pct; }, 1) +
                     " % of the tumour's motion";
  text += runs.size() > 1 ? " (least in " + least->scenario : " (" + least->scenario;
  if (least->error_mm.initial && least->error_mm.cross) {
    text += ": " + number(least->error_mm.initial->mean, 2) + " mm before, " +
            number(least->error_mm.cross->mean, 2) + " mm after";
  }
  return text + "), against " + number(paper::kContactRecovery_pct, 0) +
         " % in the paper's simulated case and " + number(paper::kPatientsRecovery_pct, 0) +
         " % in its five patients";
}

std::string took(const Chosen& runs) {
  const std::string ms = range(runs, latency, 0);
  if (ms.empty()) return "";
  std::string text = "; an update took " + ms + " ms";
  const std::string ratio = range(runs, solves, 1);
  if (!ratio.empty()) text += ", " + ratio + " times one solve with the model's factor";
  return text + " (paper: " + number(paper::kPatientsTime_s / 60.0, 1) + " minutes)";
}

std::string unusable(const Chosen& runs) {
  int bad = 0, all = 0;
  for (const RunReport* run : runs) {
    all += run->updates;
    bad += run->quality ? run->quality->counts.unusable : 0;
  }
  if (all == 0) return "; no update came";
  const std::string of = std::to_string(all) + (all == 1 ? " update" : " updates");
  if (bad == 0) return "; none of " + of + " was unusable";
  return "; " + std::to_string(bad) + " of " + of + (bad == 1 ? " was" : " were") + " unusable";
}

std::string cells(const std::vector<std::string>& texts) {
  std::string html;
  for (const std::string& text : texts) html += "<td>" + text + "</td>";
  return html;
}

std::string row_of(const RunReport& run) {
  const auto mean = [](const std::optional<MeanStd>& value) {
    return value ? number(value->mean, 2) : kNothing;
  };
  return "<tr><th>" + escape_html(run.scenario) + "</th>" +
         cells({escape_html(run.method), escape_html(run.boundary), mean(run.error_mm.initial),
                mean(run.error_mm.cross), number(run.recovery_pct, 1),
                mean(run.error_mm.craniotomy_initial), mean(run.error_mm.craniotomy),
                number(run.coverage_90, 2), number(latency(run), 0), number(solves(run), 1),
                run.quality ? plain(run.quality->worst) : kNothing}) +
         "</tr>\n";
}

std::string paper_row(const std::string& name, const std::vector<std::string>& texts) {
  return "<tr class=\"paper\"><th>" + name + "</th>" + cells(texts) + "</tr>\n";
}

std::string paper_rows() {
  using namespace paper;
  const std::string method = "steepest descent";
  return paper_row("paper, simulated case",
                   {method, "contact", number(kInitial_mm.mean, 1),
                    number(kContactCross_mm.mean, 2), number(kContactRecovery_pct, 0),
                    number(kCraniotomyInitial_mm.mean, 1), number(kContactCraniotomy_mm.mean, 2),
                    kNothing, number(1e3 * kTime_s, 0), kNothing, kNothing}) +
         paper_row("the same",
                   {method, "fixed", number(kInitial_mm.mean, 1), number(kFixedCross_mm.mean, 2),
                    "(" + number(kFixedRecovery_pct, 0) + ")", kNothing, kNothing, kNothing,
                    kNothing, kNothing, kNothing}) +
         paper_row("paper, mean of five patients",
                   {method, "contact", kNothing, kNothing, number(kPatientsRecovery_pct, 0),
                    kNothing, number(kPatientsCraniotomy_mm, 1), kNothing,
                    number(1e3 * kPatientsTime_s, 0), kNothing, kNothing});
}

}  // namespace

std::string verdict(const std::vector<ReportedRun>& runs) {
  const Chosen some = chosen(runs);
  if (some.empty()) return "No run.";
  const std::string who = some.front()->boundary == "contact"
                              ? "With brain-skull contact, method " + some.front()->method + " "
                              : "Without brain-skull contact, method " + some.front()->method + " ";
  return who + recovered(some) + took(some) + unusable(some) + ".";
}

std::string summary_table(const std::vector<ReportedRun>& runs) {
  std::string html =
      "<table class=\"fits\"><thead><tr><th>scenario</th><th>method</th><th>boundary</th>"
      "<th>tumour, motion to recover (mm)</th><th>tumour, error left (mm)</th>"
      "<th>recovered (%)</th><th>craniotomy, distance before (mm)</th><th>after (mm)</th>"
      "<th>truth inside the 90 % interval (share)</th><th>update, p50 (ms)</th>"
      "<th>update over one solve</th><th>worst quality</th></tr></thead><tbody>\n";
  for (const ReportedRun& run : runs) html += row_of(run.report);
  return html + paper_rows() + "</tbody></table>\n";
}

}  // namespace brainshift::client
