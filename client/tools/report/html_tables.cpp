// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <set>

#include "client/tools/report/html_page.hpp"
#include "client/tools/report/html_table.hpp"
#include "client/tools/report/paper_values.hpp"

namespace brainshift::client {
namespace {

void add_tumour_rows(Table& table) {
  table.row("tumour shift to recover (mm)",
            [](const RunReport& r) { return number(r.error_mm.initial); },
            {number(paper::kInitial_mm), number(paper::kInitial_mm), number(paper::kInitial_mm)});
  table.row("misfit at the sparse data (mm)",
            [](const RunReport& r) { return number(r.error_mm.sparse); },
            {number(paper::kContactSparse_mm), number(paper::kFixedSparse_mm)});
  table.row("error at the cross-validation points (mm)",
            [](const RunReport& r) { return number(r.error_mm.cross); },
            {number(paper::kContactCross_mm), number(paper::kFixedCross_mm),
             number(paper::kIcpCross_mm)});
  table.row("recovered at the tumour (%)",
            [](const RunReport& r) { return number(r.recovery_pct, 1); },
            {number(paper::kContactRecovery_pct, 0),
             "(" + number(paper::kFixedRecovery_pct, 0) + ")", number(paper::kIcpRecovery_pct, 0)});
}

void add_craniotomy_rows(Table& table) {
  table.row("craniotomy, closest-point distance before (mm)",
            [](const RunReport& r) { return number(r.error_mm.craniotomy_initial); },
            {number(paper::kCraniotomyInitial_mm)});
  table.row("craniotomy, closest-point distance after (mm)",
            [](const RunReport& r) { return number(r.error_mm.craniotomy); },
            {number(paper::kContactCraniotomy_mm)});
  table.row("recovered at the craniotomy, closest-point distance (%)",
            [](const RunReport& r) { return number(r.craniotomy_recovery_pct, 1); },
            {number(paper::kContactCraniotomyRecovery_pct, 0)});
  table.row("craniotomy, displacement to recover (mm)",
            [](const RunReport& r) { return number(r.error_mm.craniotomy_displacement_initial); });
  table.row("craniotomy, displacement error (mm)",
            [](const RunReport& r) { return number(r.error_mm.craniotomy_displacement); });
  table.row("recovered at the craniotomy, displacement (%)",
            [](const RunReport& r) { return number(r.craniotomy_displacement_recovery_pct, 1); });
}

void add_field_rows(Table& table) {
  table.row("largest true displacement (mm)",
            [](const RunReport& r) { return number(r.largest_true_displacement_mm, 1); },
            {number(paper::kLargestTrue_mm, 1), number(paper::kLargestTrue_mm, 1)});
  table.row("field error, median / 99th percentile / largest (% of the largest displacement)",
            [](const RunReport& r) -> std::string {
              if (!r.field_error_pct) return kNothing;
              return number(r.field_error_pct->p50, 1) + " / " + number(r.field_error_pct->p99, 1) +
                     " / " + number(r.field_error_pct->max, 1);
            },
            {"&ndash; / &lt;&nbsp;5 / up to 10"});
  table.row("nodes with field error below 5 % (%)",
            [](const RunReport& r) { return number(r.share_below_5_pct, 1); }, {"&gt;&nbsp;99"});
  table.row("principal direction against gravity (&deg;)",
            [](const RunReport& r) { return number(r.principal_direction_deg, 1); },
            {number(paper::kContactDirection_deg, 1), number(paper::kFixedDirection_deg, 1)});
  table.row("the same of the true field (&deg;)",
            [](const RunReport& r) { return number(r.principal_direction_true_deg, 1); });
  table.row("coverage of the 90 % interval (share)",
            [](const RunReport& r) { return number(r.coverage_90, 2); });
}

void add_contact_rows(Table& table) {
  const auto contact = [](auto member, int decimals) {
    return [member, decimals](const RunReport& r) -> std::string {
      return r.contact ? number(static_cast<double>((*r.contact).*member), decimals) : kNothing;
    };
  };
  table.row("nodes in contact", contact(&ContactSummary::active, 0));
  table.row("nodes still penetrating", contact(&ContactSummary::penetrating, 0),
            {std::to_string(paper::kPenetrating)});
  table.row("largest penetration (mm)", contact(&ContactSummary::max_penetration_mm, 3));
  table.row("iterations",
            [](const RunReport& r) -> std::string {
              return r.trace.empty() ? kNothing : std::to_string(r.trace.back().iteration);
            },
            {std::to_string(paper::kIterations), "", std::to_string(paper::kIterations)});
  table.row("status of the algorithm", [](const RunReport& r) { return plain(r.status); });
}

// At most this many hypotheses of a run are shown; the report holds all.
constexpr std::size_t kMaxHypotheses = 3;

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

std::string seconds(const std::optional<double>& s) { return s ? duration(1e3 * *s) : kNothing; }

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
  for (std::size_t i = 0; i < std::min(kMaxHypotheses, run.hypotheses.size()); ++i) {
    text += (i == 0 ? "" : "<br>") + hypothesis_text(run.hypotheses[i]);
  }
  return text.empty() ? kNothing : text;
}

}  // namespace

std::string quality_badge(const std::string& verdict) {
  const char* sign = "?";
  if (verdict == to_string(Quality::kGood)) sign = "&#10003;";
  if (verdict == to_string(Quality::kCaution)) sign = "&#9651;";
  if (verdict == to_string(Quality::kUnusable)) sign = "&#10005;";
  const std::string name = escape_html(verdict);
  return "<span class=\"verdict " + name + "\">" + sign + " " + name + "</span>";
}

std::string error_table(const std::vector<ReportedRun>& runs) {
  Table table(runs, has_truth(runs));
  add_tumour_rows(table);
  add_craniotomy_rows(table);
  add_field_rows(table);
  add_contact_rows(table);
  table.row(
      "time from observation to update",
      [](const RunReport& r) { return r.latency_ms ? duration(r.latency_ms->p50) : kNothing; },
      {duration(1e3 * paper::kTime_s)});
  return table.finish();
}

std::string left_out_table(const std::vector<ReportedRun>& runs) {
  std::string rows;
  for (const ReportedRun& run : runs) {
    for (const LeftOutScore& score : run.report.leave_one_out) {
      const auto cell = [](const std::string& text) { return "<td>" + text + "</td>"; };
      const std::string interval =
          score.coverage_90 ? number(100.0 * *score.coverage_90, 0) + " %" : std::string();
      rows += "<tr>" + cell(escape_html(run.report.scenario + ", " + run.report.boundary)) +
              cell(escape_html(score.source)) + cell(escape_html(score.kind)) +
              cell(std::to_string(score.points)) + cell(number(score.initial)) +
              cell(score.rigid ? number(score.rigid) : "") + cell(number(score.error)) +
              cell(interval) + "</tr>\n";
    }
  }
  if (rows.empty()) return "";
  return "<table class=\"fits\">\n<thead><tr><th>run</th><th>instrument</th><th>what</th>"
         "<th>points</th><th>without correction (mm)</th><th>rigid fit (mm)</th><th>predicted "
         "(mm)</th>"
         "<th>inside the 90 % interval</th></tr></thead>\n<tbody>" +
         rows + "</tbody></table>\n";
}

std::string timing_table(const std::vector<ReportedRun>& runs) {
  Table table(runs, false);
  table.row("mesh: nodes / tetrahedra / slaves", [](const RunReport& r) {
    return std::to_string(r.mesh.nodes) + " / " + std::to_string(r.mesh.tets) + " / " +
           std::to_string(r.mesh.slaves);
  });
  table.row("preparation", [](const RunReport& r) { return seconds(r.prepare_s); });
  table.row("of it factorisation", [](const RunReport& r) { return seconds(r.factor_s); });
  table.row("prepared model (MiB)", [](const RunReport& r) -> std::string {
    return r.model_bytes ? number(static_cast<double>(*r.model_bytes) / (1 << 20), 0) : kNothing;
  });
  table.row("one full solve", [](const RunReport& r) { return duration(r.full_solve_ms); });
  table.row("updates", [](const RunReport& r) { return std::to_string(r.updates); });
  table.row("latency p50 / p95 / p99 / max", [](const RunReport& r) -> std::string {
    if (!r.latency_ms) return kNothing;
    return duration(r.latency_ms->p50) + " / " + duration(r.latency_ms->p95) + " / " +
           duration(r.latency_ms->p99) + " / " + duration(r.latency_ms->max);
  });
  table.row("first update", [](const RunReport& r) { return duration(r.cold_ms); });
  table.row("first streamed iterate",
            [](const RunReport& r) { return duration(r.first_iterate_ms); });
  const auto stage = [](double StageTimings::*member) {
    return [member](const RunReport& r) -> std::string {
      return r.stages_ms ? duration((*r.stages_ms).*member) : kNothing;
    };
  };
  table.row("stage: register", stage(&StageTimings::register_ms));
  table.row("stage: invert", stage(&StageTimings::invert_ms));
  table.row("stage: rebuild", stage(&StageTimings::rebuild_ms));
  table.row("stage: encode", stage(&StageTimings::encode_ms));
  table.row("stage: journal", stage(&StageTimings::journal_ms));
  return table.finish();
}

std::string source_table(const std::vector<ReportedRun>& runs) {
  const auto compared = [](const SourceSummary& source) { return !std::isnan(source.p_value); };
  const bool several = std::any_of(runs.begin(), runs.end(), [&](const ReportedRun& run) {
    return std::any_of(run.report.sources.begin(), run.report.sources.end(), compared);
  });
  std::string rows;
  for (const ReportedRun& run : runs) {
    for (const SourceSummary& source : run.report.sources) {
      const auto cell = [](const std::string& text) { return "<td>" + text + "</td>"; };
      rows += "<tr>" + cell(escape_html(run.report.scenario + ", " + run.report.boundary)) +
              cell(escape_html(source.source)) + cell(std::to_string(source.observation_sequence)) +
              cell(number(source.age_s, 0)) + cell(std::to_string(source.data)) +
              cell(std::to_string(source.outliers));
      if (several) {
        const bool has = compared(source);
        rows +=
            cell(has ? number(source.chi_square, 1) + " / " + number(source.degrees_of_freedom, 1)
                     : "") +
            cell(has ? number(source.p_value, 4) : "") +
            cell(source.consistent ? "yes" : "<strong>no</strong>");
      }
      rows += "</tr>\n";
    }
  }
  if (rows.empty()) return "";
  return "<div class=\"scroll\"><table "
         "class=\"fits\">\n<thead><tr><th>run</th><th>instrument</th><th>observation</th><th>age "
         "(s)</th><th>data</th><th>outliers</th>" +
         std::string(several ? "<th>chi-square</th><th>p</th><th>consistent</th>" : "") +
         "</tr></thead>\n<tbody>" + rows + "</tbody></table></div>\n";
}

std::string left_out_list(const std::vector<ReportedRun>& runs) {
  std::vector<std::string> items;
  for (const ReportedRun& run : runs) {
    for (const Omission& omission : run.report.left_out) {
      std::string item =
          "<li><strong>" + escape_html(omission.part) +
          "</strong>: " + escape_html(omission.reason) +
          " <span class=\"soft\">(estimated error: " +
          (omission.estimated_error.empty() ? "not known" : escape_html(omission.estimated_error)) +
          ")</span></li>\n";
      if (std::find(items.begin(), items.end(), item) == items.end())
        items.push_back(std::move(item));
    }
  }
  if (items.empty()) return "";
  std::string html = "<ul>\n";
  for (const std::string& item : items) html += item;
  return html + "</ul>\n";
}

std::string failure_list(const std::vector<ReportedRun>& runs) {
  std::string items;
  for (const ReportedRun& run : runs) {
    for (const RunFailure& failure : run.report.failures) {
      items += "<li>" + escape_html(run.report.scenario) + ", " + escape_html(run.report.boundary) +
               ", observation " + std::to_string(failure.observation_sequence) + ": " +
               escape_html(failure.message) + " (" + escape_html(failure.code) + ")</li>\n";
    }
  }
  return items.empty() ? "" : "<ul class=\"failures\">\n" + items + "</ul>\n";
}

// Whether the fields of each run could be used: a column per run, a row per verdict, flag and part
// of the prior. A verdict is told by word, sign and frame, so that no reader depends on colours.

std::string quality_table(const std::vector<ReportedRun>& runs) {
  Table table(runs, false);
  table.row("worst update", of_quality([](const RunQuality& q) { return quality_badge(q.worst); }));
  table.row("last update", of_quality([](const RunQuality& q) { return quality_badge(q.last); }));
  table.row("reason given with the last update", of_quality([](const RunQuality& q) {
              return "<span class=\"words\">" + plain(q.reason) + "</span>";
            }));
  table.row("updates: good / with caution / unusable", of_quality(counts));
  table.row("known about the region of surgery (share)",
            [](const RunReport& run) { return number(run.region_known, 2); });
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
