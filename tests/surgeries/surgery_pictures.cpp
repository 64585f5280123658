// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/surgery_pictures.hpp"

#include <string>
#include <vector>

#include "tests/surgeries/dot_chart.hpp"

namespace brainshift::surgeries {
namespace {

namespace palette = client::palette;

struct Picture {
  const char* file;
  const char* title;
  client::Axis y;
  RowValue value;
  std::vector<double> bounds;  // dashed
};

// Of one head.
Strip strip_of(std::size_t head, std::size_t heads) {
  const double width = 0.8 / static_cast<double>(heads);
  const double left = -0.4 + width * static_cast<double>(head);
  return {left + 0.1 * width, left + 0.9 * width};
}

Status draw(const Rows& rows, const Picture& picture, const std::filesystem::path& folder) {
  const std::vector<std::string> scenarios = rows.values("scenario"), heads = rows.values("head");
  client::ChartSpec spec;
  spec.title = picture.title;
  spec.subtitle = "a dot per simulated surgery: the default estimate with all its sources";
  spec.x.label = "scenario";
  spec.x.names = scenarios;
  spec.x.from_zero = false;
  spec.y = picture.y;
  spec.size = {2200, 1000};  // room for the names
  const cv::Scalar colours[] = {palette::kBlue, palette::kVermillion, palette::kGreen};
  const client::Marker markers[] = {client::Marker::kCircle, client::Marker::kTriangle,
                                    client::Marker::kSquare};
  for (std::size_t h = 0; h < heads.size(); ++h) {
    const Rows of = rows.where("head", heads[h]);
    const Strip strip = strip_of(h, heads.size());
    client::Series series;
    for (std::size_t s = 0; s < scenarios.size(); ++s) {
      add_dots(series, of.where("scenario", scenarios[s]), s, strip, picture.value);
    }
    series.legend = heads[h];
    series.colour = colours[h % std::size(colours)];
    series.marker = markers[h % std::size(markers)];
    spec.series.push_back(std::move(series));
  }
  for (std::size_t i = 0; i < picture.bounds.size(); ++i) {
    spec.series.push_back(
        bound_line(picture.bounds[i], scenarios.size(), i == 0 ? "bound of the mean" : ""));
  }
  return write_chart(spec, folder / picture.file);
}

}  // namespace

Status draw_surgeries(const Rows& rows, const std::filesystem::path& folder) {
  const auto column = [](const char* name) {
    return [name](const Rows& of, std::size_t i) { return of.number(i, name); };
  };
  const Picture pictures[] = {
      {"surgeries-tumour.png",
       "Left of the tumour's motion after correction",
       {.label = "error / motion (%)", .log = true},
       [](const Rows& of, std::size_t i) { return 100.0 - of.number(i, "recovered_pct"); },
       {5.0}},
      {"surgeries-coverage.png",
       "Coverage of the 90 % interval, all nodes",
       {.label = "share of true components inside"},
       column("coverage_90"),
       {0.80, 0.97}},
      {"surgeries-field.png",
       "Error of the whole field after correction",
       {.label = "mean over all nodes (mm)", .log = true},
       column("field_mean_mm"),
       {}}};
  const Rows last = rows.last_updates();
  for (const Picture& picture : pictures) {
    if (Status ok = draw(last, picture, folder); !ok) return ok;
  }
  return {};
}

}  // namespace brainshift::surgeries
