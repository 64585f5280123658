// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/surgery_pictures.hpp"

#include <cmath>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "client/plot/chart.hpp"

namespace brainshift::surgeries {
namespace {

namespace palette = client::palette;

struct Picture {
  const char* file;
  const char* title;
  client::Axis y;
  std::function<double(const Rows&, std::size_t)> value;
  std::vector<double> bounds;  // dashed
};

// Left and right ends of the dots of one head in a scenario's column, which is 1 wide.
struct Strip {
  double left = 0.0, right = 0.0;
};
Strip strip_of(std::size_t head, std::size_t heads) {
  const double width = 0.8 / static_cast<double>(heads);
  const double left = -0.4 + width * static_cast<double>(head);
  return {left + 0.1 * width, left + 0.9 * width};
}

client::Series dots(const Rows& rows, const std::vector<std::string>& scenarios, Strip strip,
                    const Picture& picture) {
  client::Series series;
  for (std::size_t s = 0; s < scenarios.size(); ++s) {
    const Rows of = rows.where("scenario", scenarios[s]);
    for (std::size_t i = 0; i < of.size(); ++i) {
      const double at =
          of.size() > 1 ? static_cast<double>(i) / static_cast<double>(of.size() - 1) : 0.5;
      series.points.push_back(
          {static_cast<double>(s) + strip.left + at * (strip.right - strip.left),
           picture.value(of, i), ""});
    }
  }
  return series;
}

client::Series bound_line(double bound, std::size_t scenarios, bool first) {
  client::Series series;
  series.legend = first ? "bound of the mean" : "";
  series.colour = palette::kInk;
  series.marker = client::Marker::kNone;
  series.line = true;
  series.dash_px = 10.0;
  series.points = {{-0.5, bound, ""}, {static_cast<double>(scenarios) - 0.5, bound, ""}};
  return series;
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
    client::Series series =
        dots(rows.where("head", heads[h]), scenarios, strip_of(h, heads.size()), picture);
    series.legend = heads[h];
    series.colour = colours[h % std::size(colours)];
    series.marker = markers[h % std::size(markers)];
    spec.series.push_back(std::move(series));
  }
  for (std::size_t i = 0; i < picture.bounds.size(); ++i) {
    spec.series.push_back(bound_line(picture.bounds[i], scenarios.size(), i == 0));
  }
  const std::filesystem::path file = folder / picture.file;
  if (cv::imwrite(file.string(), client::draw_chart(spec))) return {};
  return fail(ErrorCode::kWriteFailed, file.string() + ": cannot be written");
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
