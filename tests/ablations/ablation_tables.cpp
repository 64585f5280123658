// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/ablations/ablation_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/ablations/ablation_truths.hpp"
#include "tests/ablations/comparison.hpp"
#include "tests/ablations/parts.hpp"
#include "tests/support/study_record.hpp"
#include "tests/surgeries/dot_chart.hpp"

namespace brainshift::ablations {
namespace {

using surgeries::Rows;
namespace palette = client::palette;

// A part that has rows, held against the default.
struct Held {
  const Part* part;
  std::vector<Difference> differences;
  Balance result;

  const Difference* find(const std::string& measure, const std::string& group,
                         const std::string& data) const {
    const auto found =
        std::find_if(differences.begin(), differences.end(), [&](const Difference& one) {
          return one.measure == measure && one.group == group && one.data == data;
        });
    return found == differences.end() ? nullptr : &*found;
  }
};

std::vector<Held> held_parts(const Rows& rows) {
  std::vector<Held> all;
  for (const Part& part : all_parts()) {
    if (part.variant.name == kDefault || rows.where("variant", part.variant.name).empty()) continue;
    Held held{&part, differences(rows, part), {}};
    held.result = balance(held.differences, part);
    all.push_back(std::move(held));
  }
  return all;
}

std::string ratio_text(double ratio) {
  return std::isfinite(ratio) ? fmt::format("{:.2f}", ratio) : std::string("–");
}
std::string ratio_text(const Difference* difference) {
  return difference == nullptr ? "–" : ratio_text(1.0 + difference->change());
}

std::string found_text(const std::vector<Difference>& found, std::size_t of) {
  if (found.empty()) return "nothing";
  return fmt::format("{} of {}; {}", found.size(), of, text_of(found.front()));
}

struct Picture {
  std::string file;
  const char* title;
  const char* measure;
};

// The groups' marks; the first is kEverything's.
struct Mark {
  cv::Scalar colour;
  client::Marker marker;
};
const std::array<Mark, 11>& marks() {
  static const std::array<Mark, 11> all = {{{palette::kBlack, client::Marker::kCircle},
                                            {palette::kBlue, client::Marker::kCircle},
                                            {palette::kSkyBlue, client::Marker::kSquare},
                                            {palette::kGreen, client::Marker::kTriangle},
                                            {palette::kOrange, client::Marker::kCircle},
                                            {palette::kVermillion, client::Marker::kSquare},
                                            {palette::kPurple, client::Marker::kTriangle},
                                            {palette::kGrey, client::Marker::kSquare},
                                            {palette::kOrange, client::Marker::kTriangle},
                                            {palette::kInk, client::Marker::kTriangle},
                                            {palette::kBlue, client::Marker::kSquare}}};
  return all;
}

Status draw(const std::vector<Held>& parts, const Picture& picture,
            const std::filesystem::path& folder) {
  client::ChartSpec spec;
  spec.title = picture.title;
  spec.subtitle =
      "geometric mean over surgeries, updates from all data; above 1: the change made it worse";
  spec.x.label = "what was changed, one at a time";
  spec.x.from_zero = false;
  spec.y = {.label = "error, changed / default", .log = true};
  spec.size = {4400, 1300};  // room for the names
  const std::vector<std::string>& groups = group_names();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    client::Series series;
    series.legend = groups[g];
    series.colour = marks()[g % marks().size()].colour;
    series.marker = marks()[g % marks().size()].marker;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const Difference* found = parts[i].find(picture.measure, groups[g], "all data");
      if (found == nullptr) continue;
      const double aside = 0.08 * (static_cast<double>(g) - 5.0);
      series.points.push_back({static_cast<double>(i) + aside, 1.0 + found->change(), ""});
    }
    spec.series.push_back(std::move(series));
  }
  spec.series.push_back(surgeries::bound_line(1.0, parts.size(), ""));
  for (const Held& held : parts) spec.x.names.push_back(held.part->variant.name);
  return surgeries::write_chart(spec, folder / picture.file);
}

}  // namespace

std::string parts_table(const Rows& rows) {
  std::string text =
      "| part | changed | tumour, tumour alone | tumour | craniotomy | brain | time | the part "
      "buys "
      "| the part costs |\n|---|---|---|---|---|---|---|---|---|\n";
  for (const Held& held : held_parts(rows)) {
    const std::size_t of = held.differences.size();
    text += fmt::format("| {}{} | {} | {} | {} | {} | {} | {} | {} | {} |\n", held.part->name,
                        held.part->added ? " (off by default)" : "", held.part->change,
                        ratio_text(held.find("tumour", kEverything, "tumour alone")),
                        ratio_text(held.find("tumour", kEverything, "all data")),
                        ratio_text(held.find("craniotomy", kEverything, "all data")),
                        ratio_text(held.find("brain", kEverything, "all data")),
                        ratio_text(median_time_ratio(rows, *held.part)),
                        found_text(held.result.buys, of), found_text(held.result.costs, of));
  }
  return text;
}

std::string short_rows(const Rows& rows) {
  constexpr std::array kColumns = {"head",       "patient",     "truth",   "seed",
                                   "variant",    "data",        "status",  "nodes",
                                   "initial_mm", "tumour_mm",   "cppd_mm", "initial_field_mm",
                                   "field_mm",   "coverage_90", "quality", "update_ms"};
  std::string text;
  for (const char* column : kColumns) text += fmt::format("{}{}", text.empty() ? "" : ",", column);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t c = 0; c < kColumns.size(); ++c) {
      text += (c == 0 ? '\n' : ',') + rows.text(i, kColumns[c]);
    }
  }
  return text + '\n';
}

std::string left_out_list() {
  std::string text;
  for (const LeftOut& one : parts_left_out()) {
    text += fmt::format("- {}: {}\n", one.part, one.reason);
  }
  return text;
}

void check_ablations(const Rows& rows) {
  const std::string source =
      fmt::format("{} surgeries of {} patients; {} nodes",
                  rows.where("variant", kDefault).where("data", "tumour").size(),
                  rows.values("patient").size(), rows.text(0, "nodes"));
  for (const Held& held : held_parts(rows)) {
    const auto buys = static_cast<double>(held.result.buys.size());
    const std::string name = held.part->name + ": combinations in which it buys something";
    const std::string beside = fmt::format("of {}; it costs something in {}",
                                           held.differences.size(), held.result.costs.size());
    if (held.part->added) {
      test_support::record_figure("ablations", name, buys, "shown; " + beside, source);
    } else {
      test_support::record_check("ablations", name, buys, ">= 1 (" + beside + ")", buys >= 1.0,
                                 source);
    }
  }
  test_support::record_figure("ablations", "updates that were refused",
                              static_cast<double>(rows.where("status", "refused").size()),
                              fmt::format("shown; of {}", rows.size()), source);
  for (const LeftOut& one : parts_left_out()) {
    std::string reason = one.part + ": " + one.reason;
    std::replace(reason.begin(), reason.end(), ',', ';');
    test_support::record_left_out("ablations", reason);
  }
}

Status draw_ablations(const Rows& rows, const std::filesystem::path& folder) {
  // In three pictures, so that the names have room.
  std::vector<Held> prior, data, off;
  for (Held& held : held_parts(rows)) {
    const bool of_prior = held.part->variant.anew == evidence::Anew::kOperators;
    (held.part->added ? off : of_prior ? prior : data).push_back(std::move(held));
  }
  for (const auto& [parts, suffix] :
       {std::pair{&prior, "-prior.png"}, {&data, "-data.png"}, {&off, "-off.png"}}) {
    if (parts->empty()) continue;
    for (const auto& [measure, title] :
         {std::pair{"tumour", "Error at the tumour without a part, or with one more"},
          {"craniotomy",
           "Closest point distance at the craniotomy without a part, or with one more"}}) {
      const Picture picture{std::string("ablations-") + measure + suffix, title, measure};
      if (Status ok = draw(*parts, picture, folder); !ok) return ok;
    }
  }
  return {};
}

}  // namespace brainshift::ablations
