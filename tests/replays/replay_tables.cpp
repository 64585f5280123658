// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/replay_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "common/core/statistics.hpp"
#include "common/io/files/file_access.hpp"
#include "tests/benchmarks/csv_table.hpp"
#include "tests/replays/replay_rows.hpp"

namespace brainshift::replays {
namespace {

using surgeries::Rows;

Rows warm(const Rows& rows) {
  return rows.where([](const Rows& all, std::size_t i) { return all.number(i, "update") > 1.0; });
}
Rows cold(const Rows& rows) { return rows.where("update", "1"); }

void for_each_entry(const Rows& rows, const std::function<void(const Rows&)>& use) {
  for (const std::string& surgery : rows.values("surgery")) {
    const Rows own = rows.where("surgery", surgery);
    for (const std::string& speed : own.values("speed")) use(own.where("speed", speed));
  }
}

std::vector<double> in_solves(const Rows& rows, const std::string& column) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double ratio = rows.number(i, column) / rows.number(i, "t_solve_ms");
    if (std::isfinite(ratio)) ratios.push_back(ratio);
  }
  return ratios;
}

// What was sent in a pass: sequences with their sources.
std::set<std::string> sent(const Rows& rows) {
  std::set<std::string> all;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    all.insert(rows.text(i, "seed") + "/" + rows.text(i, "sequence") + "/" +
               rows.text(i, "source"));
  }
  return all;
}

std::string ms(double value) { return fmt::format("{:.{}f}", value, value < 1.0 ? 2 : 1); }

std::string latency_table(const Rows& rows) {
  std::string text =
      "| surgery | speed | updates | p50 ms | p95 | p99 | largest | p50 / t_solve | first update "
      "p50 "
      "ms | p95 - p50 ms | standard deviation ms | sent late at most ms |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  const std::vector<Jitter> spreads = jitter(rows);
  for (const StageTimes& one : stage_times(rows)) {
    if (one.stage != stage_names().back()) continue;
    const auto spread = std::find_if(spreads.begin(), spreads.end(), [&](const Jitter& each) {
      return each.surgery == one.surgery && each.speed == one.speed;
    });
    text += fmt::format("| `{}` | {} | {} | {} | {} | {} | {} | {:.2f} | {} | {} | {} | {} |\n",
                        one.surgery, one.speed, one.updates, ms(one.p50_ms), ms(one.p95_ms),
                        ms(one.p99_ms), ms(one.max_ms), one.p50_solves, ms(spread->cold_p50_ms),
                        ms(spread->spread_ms), ms(spread->sd_ms),
                        std::isfinite(spread->sent_late_ms) ? ms(spread->sent_late_ms) : "–");
  }
  return text;
}

std::string stage_table(const Rows& rows) {
  std::string text = "| surgery | speed |", line = "|---|---|";
  for (const std::string& stage : stage_names()) {
    text += " " + stage + " |";
    line += "---|";
  }
  text += "\n" + line;
  std::string entry;
  for (const StageTimes& one : stage_times(rows)) {
    if (one.surgery + one.speed != entry)
      text += fmt::format("\n| `{}` | {} |", one.surgery, one.speed);
    entry = one.surgery + one.speed;
    text += fmt::format(" {}, {}, {} |", ms(one.p50_ms), ms(one.p95_ms), ms(one.p99_ms));
  }
  return text + "\n";
}

}  // namespace

const std::vector<std::string>& stage_names() {
  static const std::vector<std::string> names = {"register", "invert",  "rebuild",
                                                 "encode",   "journal", "latency"};
  return names;
}

std::vector<StageTimes> stage_times(const Rows& rows) {
  std::vector<StageTimes> all;
  for_each_entry(rows, [&](const Rows& entry) {
    const Rows own = warm(entry);
    for (const std::string& stage : stage_names()) {
      const std::vector<double> times = own.numbers(stage + "_ms");
      if (times.empty()) continue;
      const std::vector<double> solves = in_solves(own, stage + "_ms");
      all.push_back({own.text(0, "surgery"), own.text(0, "speed"), stage,
                     static_cast<int>(times.size()), percentile(times, 50), percentile(times, 95),
                     percentile(times, 99), percentile(times, 100), percentile(solves, 50),
                     percentile(solves, 95)});
    }
  });
  return all;
}

std::vector<Jitter> jitter(const Rows& rows) {
  std::vector<Jitter> all;
  for_each_entry(rows, [&](const Rows& entry) {
    const std::vector<double> latency = warm(entry).numbers("latency_ms");
    const std::vector<double> first = cold(entry).numbers("latency_ms");
    all.push_back({entry.text(0, "surgery"), entry.text(0, "speed"), percentile(first, 50),
                   percentile(latency, 95) - percentile(latency, 50), mean_std(latency).std,
                   entry.largest("sent_late_ms")});
  });
  return all;
}

std::vector<StageRatio> stage_ratios(const Rows& now, const Rows& committed) {
  std::vector<StageRatio> all;
  if (!not_comparable(now, committed).empty()) return all;
  const std::vector<StageTimes> ours = stage_times(now), theirs = stage_times(committed);
  const auto add = [&](const std::string& stage, const char* quantile, double a, double b) {
    if (std::max(a, b) < kLeastSolves) return;
    all.push_back({stage, quantile, a, b, std::max(a, kLeastSolves) / std::max(b, kLeastSolves)});
  };
  for (const StageTimes& one : ours) {
    const auto other = std::find_if(theirs.begin(), theirs.end(), [&](const StageTimes& each) {
      return each.stage == one.stage;
    });
    if (other == theirs.end()) continue;
    add(one.stage, "p50", one.p50_solves, other->p50_solves);
    add(one.stage, "p95", one.p95_solves, other->p95_solves);
  }
  return all;
}

std::string not_comparable(const Rows& now, const Rows& committed) {
  if (committed.empty()) return "no committed rows of it";
  for (const char* column : {"head", "nodes"}) {
    if (now.text(0, column) == committed.text(0, column)) continue;
    return fmt::format("{} is {}; that of the committed rows {}", column, now.text(0, column),
                       committed.text(0, column));
  }
  return sent(now) == sent(committed) ? "" : "the committed rows are of other observations";
}

Status write_tables(const Rows& rows, const std::filesystem::path& folder) {
  auto csv = bench::CsvWriter::create(
      folder / "percentiles.csv",
      "surgery,speed,stage,updates,p50_ms,p95_ms,p99_ms,max_ms,p50_solves,p95_solves");
  if (!csv) return tl::unexpected(csv.error());
  for (const StageTimes& one : stage_times(rows)) {
    std::vector<std::string> cells = {one.surgery, one.speed, one.stage,
                                      std::to_string(one.updates)};
    for (const double value :
         {one.p50_ms, one.p95_ms, one.p99_ms, one.max_ms, one.p50_solves, one.p95_solves}) {
      cells.push_back(bench::csv_number(value));
    }
    if (Status ok = csv->row(cells); !ok) return ok;
  }
  return io::write_file(
      folder / "latency.md",
      fmt::format("{} nodes, t_solve {:.1f} ms, OpenBLAS kernel {}.\n\n{}\nStages, ms: p50, p95, "
                  "p99.\n\n{}",
                  rows.text(0, "nodes"), percentile(rows.numbers("t_solve_ms"), 50),
                  rows.text(0, "kernel"), latency_table(rows), stage_table(rows)));
}

}  // namespace brainshift::replays
