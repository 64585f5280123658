// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "client/tools/pictures/chart.hpp"
#include "client/tools/report/figures.hpp"
#include "client/tools/report/paper_values.hpp"

namespace brainshift::client {

std::optional<Figure> error_time_figure(const std::vector<ReportedRun>& runs) {
  ChartSpec spec;
  spec.title = "Error against run time";
  spec.subtitle =
      "mean error at the tumour's cross-validation points; time from observation to update";
  spec.x = {"time of one update (ms)", true};
  spec.y = {"error at the tumour (mm)", true};
  const cv::Scalar colours[] = {palette::kBlue, palette::kVermillion, palette::kGreen,
                                palette::kPurple, palette::kSkyBlue};
  bool several_methods = false;
  for (const ReportedRun& run : runs) {
    const RunReport& r = run.report;
    several_methods = several_methods || r.method != runs.front().report.method;
    if (!r.latency_ms || !r.error_mm.cross) continue;
    const std::string name = r.method + ", " + r.boundary;
    auto found = std::find_if(spec.series.begin(), spec.series.end(),
                              [&](const Series& s) { return s.legend == name; });
    if (found == spec.series.end()) {
      const bool fixed = r.boundary == to_string(Boundary::kFixed);
      const auto& colour = colours[spec.series.size() % std::size(colours)];
      spec.series.push_back(
          {name, colour, fixed ? Marker::kTriangle : Marker::kCircle, false, 0.0, {}});
      found = spec.series.end() - 1;
    }
    found->points.push_back({r.latency_ms->p50, r.error_mm.cross->mean, r.scenario});
  }
  if (!several_methods || spec.series.size() < 2) return std::nullopt;
  Series paper{"Ji et al. 2009 (their machine)", palette::kInk, Marker::kSquare, false, 0.0, {}};
  paper.points.push_back({1e3 * paper::kTime_s, paper::kContactCross_mm.mean, "paper"});
  spec.series.push_back(std::move(paper));

  Figure figure;
  figure.file_name = "error-time.png";
  figure.caption =
      "Error at the tumour against the time of one update, per method and boundary condition. The "
      "paper's time "
      "was measured on a machine of 2009. make bench draws the same for more methods, ranks and "
      "meshes.";
  figure.image = draw_chart(spec);
  return figure;
}

}  // namespace brainshift::client
