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
  std::optional<double> least, most;
  for (const RunReport* run : runs) {
    const std::optional<double> ms = latency(*run);
    if (!ms) continue;
    least = std::min(least.value_or(*ms), *ms);
    most = std::max(most.value_or(*ms), *ms);
  }
  if (!least) return "";
  const std::string from = duration(*least), to = duration(*most);
  std::string text = "; an update took " + (from == to ? from : from + " to " + to);
  const std::string ratio = range(runs, solves, 1);
  if (!ratio.empty()) text += ", " + ratio + " times one solve with the model's factor";
  return text + " (paper: " + duration(1e3 * paper::kPatientsTime_s) + ")";
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

// A column of the table in short: a cell for each run, and for each of the paper's three lines.
struct Column {
  std::string heading;
  Table::Cell cell;
  std::vector<std::string> paper = {};
};

std::vector<Column> columns() {
  using namespace paper;
  const auto mean = [](const std::optional<MeanStd>& value) {
    return value ? number(value->mean, 2) : kNothing;
  };
  const std::string steepest = "steepest descent";
  return {{"scenario",
           [](const RunReport& r) { return escape_html(r.scenario); },
           {"paper, simulated case", "the same", "paper, mean of five patients"}},
          {"method",
           [](const RunReport& r) { return escape_html(r.method); },
           {steepest, steepest, steepest}},
          {"boundary",
           [](const RunReport& r) { return escape_html(r.boundary); },
           {"contact", "fixed", "contact"}},
          {"tumour moved (mm)",
           [](const RunReport& r) {
             return r.tumour_shift_mm ? shift_text(*r.tumour_shift_mm) : kNothing;
           }},
          {"misfit (mm)",
           [mean](const RunReport& r) { return mean(r.error_mm.sparse); },
           {number(kContactSparse_mm.mean, 2), number(kFixedSparse_mm.mean, 2)}},
          {"left out, error predicted (mm)",
           [](const RunReport& r) {
             return r.leave_one_out.empty() ? kNothing : number(r.leave_one_out[0].error.mean, 2);
           }},
          {"tumour, motion to recover (mm)",
           [mean](const RunReport& r) { return mean(r.error_mm.initial); },
           {number(kInitial_mm.mean, 1), number(kInitial_mm.mean, 1)}},
          {"tumour, error left (mm)",
           [mean](const RunReport& r) { return mean(r.error_mm.cross); },
           {number(kContactCross_mm.mean, 2), number(kFixedCross_mm.mean, 2)}},
          {"recovered (%)",
           [](const RunReport& r) { return number(r.recovery_pct, 1); },
           {number(kContactRecovery_pct, 0), "(" + number(kFixedRecovery_pct, 0) + ")",
            number(kPatientsRecovery_pct, 0)}},
          {"craniotomy, distance before (mm)",
           [mean](const RunReport& r) { return mean(r.error_mm.craniotomy_initial); },
           {number(kCraniotomyInitial_mm.mean, 1)}},
          {"after (mm)",
           [mean](const RunReport& r) { return mean(r.error_mm.craniotomy); },
           {number(kContactCraniotomy_mm.mean, 2), "", number(kPatientsCraniotomy_mm, 1)}},
          {"truth inside the 90 % interval (share)",
           [](const RunReport& r) { return number(r.coverage_90, 2); }},
          {"update, median",
           [](const RunReport& r) { return duration(latency(r)); },
           {duration(1e3 * kTime_s), "", duration(1e3 * kPatientsTime_s)}},
          {"update over one solve", [](const RunReport& r) { return number(solves(r), 1); }},
          {"worst quality",
           [](const RunReport& r) { return r.quality ? plain(r.quality->worst) : kNothing; }}};
}

// What to do about a flag of the last update.
std::string what_next(QualityFlag flag) {
  switch (flag) {
    case QualityFlag::kMisfitUnexplained:
      return "check the patient registration, the calibrations and the outlines that the data come "
             "from";
    case QualityFlag::kStrengthAtBound:
      return "compare pose, drainage and opening of the case with the patient, and measure the "
             "exposed "
             "cortex as well";
    case QualityFlag::kSourcesContradict:
      return "find the instrument that is wrong (table of the instruments; replay --sources plays "
             "some "
             "alone)";
    case QualityFlag::kDataOutsideRegion:
      return "measure near the tumour and the opening, or prepare the case for the opening that "
             "was made";
    case QualityFlag::kMostlyPrior:
      return "measure more where it matters: the tumour's boundary, the exposed cortex, or "
             "landmarks near "
             "the target";
    case QualityFlag::kDeadline:
    case QualityFlag::kIterationLimit:
    case QualityFlag::kContactNotCertified:
      return "measure again; if it stays, allow the inversion more time or prepare a coarser mesh";
    case QualityFlag::kInvertedElements:
    case QualityFlag::kVolumeLost:
    case QualityFlag::kBeyondSkull:
    case QualityFlag::kNotFinite: break;
  }
  return "check units (mm), axes (RAS) and registration of the data, and measure again";
}

std::string next_steps(const RunQuality& quality) {
  std::vector<std::string> steps;
  for (const QualityFlag flag : kAllQualityFlags) {
    const auto& flags = quality.last_flags;
    if (std::find(flags.begin(), flags.end(), to_string(flag)) == flags.end()) continue;
    const std::string step = what_next(flag);
    if (std::find(steps.begin(), steps.end(), step) == steps.end()) steps.push_back(step);
  }
  if (steps.empty() && quality.last == to_string(Quality::kGood)) {
    steps = {
        "use the field where the map of what the data know is high, and measure again as surgery "
        "goes on"};
  }
  std::string text;
  for (const std::string& step : steps) text += (text.empty() ? "" : "; ") + step;
  return text;
}

std::string left_out_text(const LeftOutScore& score) {
  std::string text =
      std::to_string(score.points) +
      (score.kind == "landmarks" ? " landmarks of " : " points of the ") +
      (score.kind == "landmarks" ? score.source : score.kind + " (" + score.source + ")") +
      " were left out and predicted from the rest to " + number(score.error.mean, 1) +
      " mm, from " + number(score.initial.mean, 1) + " mm without correction";
  if (score.rigid) text += "; a rigid fit comes to " + number(score.rigid->mean, 1) + " mm";
  if (score.coverage_90) {
    text += "; " + number(100.0 * *score.coverage_90, 0) +
            " % of their displacements lie in the 90 % "
            "interval";
  }
  return escape_html(text + ".");
}

}  // namespace

bool has_truth(const std::vector<ReportedRun>& runs) {
  return std::any_of(runs.begin(), runs.end(),
                     [](const ReportedRun& run) { return run.report.recovery_pct.has_value(); });
}

std::string verdict(const std::vector<ReportedRun>& runs) {
  const Chosen some = chosen(runs);
  if (least_recovered(some) == nullptr) return "";
  const std::string who = some.front()->boundary == "contact"
                              ? "With brain-skull contact, method " + some.front()->method + " "
                              : "Without brain-skull contact, method " + some.front()->method + " ";
  return who + recovered(some) + took(some) + unusable(some) + ".";
}

std::string shift_text(const TumourShift& shift) {
  const int decimals = shift.sd && *shift.sd < 0.095 ? 2 : 1;
  std::string text = number(shift.mean, decimals);
  if (shift.sd) text += "&nbsp;&plusmn;&nbsp;" + number(*shift.sd, decimals);
  return text;
}

std::string headline(const RunReport& run) {
  std::string html = "<p class=\"headline\"><strong>" + escape_html(run.scenario) + "</strong>: ";
  if (run.updates == 0 || !run.quality) return html + "no update came.</p>\n";
  const bool shown = run.error_mm.sparse.has_value();
  if (run.tumour_shift_mm) {
    html += "the tumour moved <strong>" + shift_text(*run.tumour_shift_mm) + "&nbsp;mm</strong>; ";
  }
  if (shown) html += "misfit " + number(run.error_mm.sparse->mean, 2) + "&nbsp;mm; ";
  const RunQuality& quality = *run.quality;
  html += quality_badge(quality.last);
  if (!quality.reason.empty()) html += " because " + escape_html(quality.reason);
  html += ".</p>\n";
  const auto more = [&](const std::string& text) {
    html += "<p class=\"more\">" + text + "</p>\n";
  };
  if (quality.last == to_string(Quality::kUnusable)) {
    more(shown ? "The last update is not to be used; the figures are of the last usable one."
               : "No update was usable: there is no field.");
  }
  if (run.error_mm.initial && run.error_mm.cross && run.recovery_pct) {
    more("The truth: it moved " + number(run.error_mm.initial->mean, 2) + "&nbsp;mm, of which " +
         number(run.error_mm.cross->mean, 2) + "&nbsp;mm are left (" +
         number(*run.recovery_pct, 1) + " % recovered).");
  }
  for (const LeftOutScore& score : run.leave_one_out) more(left_out_text(score));
  const std::string next = next_steps(quality);
  if (!next.empty()) more("<strong>Next:</strong> " + escape_html(next) + ".");
  return html;
}

std::string summary_table(const std::vector<ReportedRun>& runs) {
  std::vector<Column> shown;
  for (Column& column : columns()) {
    if (std::any_of(runs.begin(), runs.end(),
                    [&](const ReportedRun& run) { return column.cell(run.report) != kNothing; })) {
      shown.push_back(std::move(column));
    }
  }
  std::string html = "<div class=\"scroll\"><table class=\"fits\"><thead><tr>";
  for (const Column& column : shown) html += "<th>" + column.heading + "</th>";
  html += "</tr></thead><tbody>\n";
  const auto row = [&](const std::string& opening, const auto& text_of) {
    html += opening;
    for (const Column& column : shown) {
      const bool first = &column == &shown.front();
      html += (first ? "<th>" : "<td>") + text_of(column) + (first ? "</th>" : "</td>");
    }
    html += "</tr>\n";
  };
  for (const ReportedRun& run : runs) {
    row("<tr>", [&](const Column& column) { return column.cell(run.report); });
  }
  for (std::size_t line = 0; has_truth(runs) && line < 3; ++line) {
    row("<tr class=\"paper\">", [&](const Column& column) {
      return line < column.paper.size() ? column.paper[line] : std::string();
    });
  }
  return html + "</tbody></table></div>\n";
}

}  // namespace brainshift::client
