// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/replay_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "common/core/statistics.hpp"
#include "tests/replays/replay_rows.hpp"
#include "tests/replays/replay_tables.hpp"
#include "tests/support/study_record.hpp"
#include "tests/surgeries/row_file.hpp"

namespace brainshift::replays {
namespace {

using surgeries::Rows;
using test_support::record_check;
using test_support::record_figure;
using test_support::record_left_out;

std::string source_of(const Rows& rows) {
  return fmt::format("{}; {} nodes; OpenBLAS kernel {}", rows.text(0, "head"),
                     rows.text(0, "nodes"), rows.text(0, "kernel"));
}

Rows fields(const Rows& rows) { return rows.where("outcome", "field"); }

// Nothing arrived for it within the patience of the client, or nothing is known of it.
bool is_lost(const Rows& rows, std::size_t i) {
  const std::string& outcome = rows.text(i, "outcome");
  return outcome.empty() || outcome == to_string(ErrorCode::kUnavailable);
}

struct LateCount {
  int unmarked = 0;  // of those that could be marked
  int too_few = 0;   // of those that came when nothing was usual
};

LateCount old_fields(const Rows& rows) {
  LateCount count;
  for (const std::string& surgery : rows.values("surgery")) {
    const Rows of_surgery = rows.where("surgery", surgery);
    for (const std::string& pass : of_surgery.values("pass")) {
      const Rows session = fields(of_surgery.where("pass", pass));
      const double limit = kLateFactor * percentile(session.numbers("latency_ms"), 50);
      for (std::size_t i = 0; i < session.size(); ++i) {
        if (session.number(i, "latency_ms") <= limit || session.number(i, "late") == 1.0) continue;
        ++(session.number(i, "usual_ms") > 0.0 ? count.unmarked : count.too_few);
      }
    }
  }
  return count;
}

void check_speed(const std::string& speed, const Rows& rows) {
  const std::string source = source_of(rows);
  const auto check_none = [&](const char* name, int value, const std::string& of) {
    record_check(speed, name, value, "0" + of, value == 0, source);
  };
  const auto shown = [&](const char* name, double value) {
    record_figure(speed, name, value, "shown", source);
  };
  const Rows arrived = fields(rows);
  const Rows superseded = rows.where("outcome", "superseded");
  const Rows lost = rows.where(is_lost);
  const auto refused = rows.size() - arrived.size() - superseded.size() - lost.size();
  check_none("observations that nothing accounts for", static_cast<int>(lost.size()),
             fmt::format(" of {} sent ({} fields; {} superseded; {} without a field)", rows.size(),
                         arrived.size(), superseded.size(), refused));
  const LateCount old = old_fields(rows);
  check_none("fields later than 3 x the median of their session and not marked late", old.unmarked,
             fmt::format(" of {}", arrived.size()));
  shown("the same before a session has enough answers to tell", old.too_few);
  const int missed = arrived.count("deadline", [](double flag) { return flag == 1.0; });
  if (speed == kRecordedSpeed) {
    check_none("missed deadlines", missed, fmt::format(" of {}", arrived.size()));
  } else {
    shown("missed deadlines", missed);
  }
  shown("observations superseded by a newer one", static_cast<double>(superseded.size()));
  shown("fields marked late", arrived.count("late", [](double mark) { return mark == 1.0; }));
  for (const char* quality : {"good", "caution", "unusable"}) {
    record_figure(speed, fmt::format("fields of quality {}", quality),
                  static_cast<double>(arrived.where("quality", quality).size()), "shown", source);
  }
}

void check_agreement(const Rows& rows) {
  const std::vector<double> differences = rows.numbers("difference_mm");
  const Rows full = rows.where("speed", kFullSpeed);
  const auto across = full.numbers("difference_mm").size();
  if (rows.where("speed", kRecordedSpeed).empty() || full.empty() || across == 0) {
    record_left_out("both speeds", "no field at one speed has the evidence of one at the other");
    return;
  }
  const double largest = *std::max_element(differences.begin(), differences.end());
  record_check("both speeds", "fields of the same evidence: greatest difference of a node mm",
               largest,
               fmt::format("<= {:g} ({} compared; {} of them at full speed)", kMostDifference_mm,
                           differences.size(), across),
               largest <= kMostDifference_mm, source_of(rows));
}

void check_entry(const Rows& now, const Rows& committed) {
  const std::string study = now.text(0, "surgery") + " " + now.text(0, "speed");
  const std::string reason = not_comparable(now, committed);
  const std::vector<StageRatio> ratios = stage_ratios(now, committed);
  if (ratios.empty()) {
    record_left_out(study,
                    "regression: " + (reason.empty() ? "no stage takes long enough" : reason));
    return;
  }
  const auto worst =
      std::max_element(ratios.begin(), ratios.end(),
                       [](const StageRatio& a, const StageRatio& b) { return a.ratio < b.ratio; });
  record_check(
      study, "slowest stage over the committed run", worst->ratio,
      fmt::format("<= {:g} ({} {}: {:.2f} t_solve now; {:.2f} committed)", kMostRatio, worst->stage,
                  worst->quantile, worst->now_solves, worst->committed_solves),
      worst->ratio <= kMostRatio,
      source_of(now) + "; committed with " + committed.text(0, "kernel"));
}

}  // namespace

void check_corpus(const std::optional<std::vector<ManifestEntry>>& committed,
                  const std::vector<ManifestEntry>& made) {
  if (!committed) {
    record_left_out("corpus", "no table of its observations is kept for this case");
    return;
  }
  const ManifestComparison comparison = compare_manifests(*committed, made);
  const auto differ = comparison.differences.size();
  std::string bound = fmt::format("0 of {} ({} bit for bit; {} within rounding)", committed->size(),
                                  comparison.same_bits, comparison.same_within_rounding);
  if (differ > 0) bound += "; first: " + surgeries::cell_text(comparison.differences.front());
  record_check("corpus", "observations that are not those of the committed table",
               static_cast<double>(differ), bound, differ == 0, "tests/replays/corpus-CASE.csv");
}

void check_replays(const Rows& rows) {
  for (const std::string& speed : rows.values("speed")) {
    check_speed(speed, rows.where("speed", speed));
  }
  check_agreement(rows);
  const std::string source = source_of(rows);
  for (const StageTimes& one : stage_times(rows)) {
    if (one.stage != stage_names().back()) continue;
    record_figure(one.surgery + " " + one.speed, "latency p50 ms", one.p50_ms,
                  fmt::format("shown; p95 {:.1f}; p99 {:.1f}; largest {:.1f}; {:.2f} t_solve",
                              one.p95_ms, one.p99_ms, one.max_ms, one.p50_solves),
                  source);
  }
  for (const Jitter& one : jitter(rows)) {
    record_figure(one.surgery + " " + one.speed, "jitter of the latency: p95 - p50 ms",
                  one.spread_ms, fmt::format("shown; standard deviation {:.1f} ms", one.sd_ms),
                  source);
  }
}

void check_regression(const Rows& rows, const Rows& committed) {
  if (committed.empty()) {
    record_left_out("regression", "no rows of an earlier run are kept for this head");
    return;
  }
  for (const std::string& surgery : rows.values("surgery")) {
    for (const std::string& speed : rows.where("surgery", surgery).values("speed")) {
      check_entry(rows.where("surgery", surgery).where("speed", speed),
                  committed.where("surgery", surgery).where("speed", speed));
    }
  }
}

}  // namespace brainshift::replays
