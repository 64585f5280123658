// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/dot_chart.hpp"

#include <opencv2/imgcodecs.hpp>

namespace brainshift::surgeries {

void add_dots(client::Series& series, const Rows& rows, std::size_t column, Strip strip,
              const RowValue& value) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double at =
        rows.size() > 1 ? static_cast<double>(i) / static_cast<double>(rows.size() - 1) : 0.5;
    const double x = static_cast<double>(column) + strip.left + at * (strip.right - strip.left);
    series.points.push_back({x, value(rows, i), ""});
  }
}

client::Series bound_line(double bound, std::size_t columns, const std::string& legend) {
  client::Series series;
  series.legend = legend;
  series.colour = client::palette::kInk;
  series.marker = client::Marker::kNone;
  series.line = true;
  series.dash_px = 10.0;
  series.points = {{-0.5, bound, ""}, {static_cast<double>(columns) - 0.5, bound, ""}};
  return series;
}

Status write_chart(const client::ChartSpec& spec, const std::filesystem::path& file) {
  if (cv::imwrite(file.string(), client::draw_chart(spec))) return {};
  return fail(ErrorCode::kWriteFailed, file.string() + ": cannot be written");
}

}  // namespace brainshift::surgeries
