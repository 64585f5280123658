// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <limits>

#include "client/tools/pictures/chart.hpp"
#include "client/tools/report/figures.hpp"

namespace brainshift::client {
namespace {

constexpr double kGapInLine = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Figure convergence_figure(const RunGroup& group, const RunReport& run) {
  ChartSpec spec;
  spec.title = "Convergence: " + run.scenario + ", " + run.boundary + " boundary";
  spec.subtitle = "case " + run.case_id + ", method " + run.method +
                  "; iteration 0 is the misfit of no displacement";
  spec.x = {.label = "iteration", .counts = true, .from_zero = false};
  spec.y.label = "mean misfit (mm)";
  spec.right = {.label = "nodes penetrating the skull", .counts = true};

  const auto series = [](const char* legend, const cv::Scalar& colour, Marker marker) {
    Series made;
    made.legend = legend;
    made.colour = colour;
    made.marker = marker;
    made.line = true;
    return made;
  };
  const auto add = [](Series& to, int iteration, double value) {
    to.points.push_back({static_cast<double>(iteration), value, ""});
  };
  Series sparse = series("sparse data", palette::kBlue, Marker::kCircle);
  Series cross = series("cross-validation", palette::kVermillion, Marker::kSquare);
  Series penetrating = series("penetrating nodes (right)", palette::kGreen, Marker::kTriangle);
  penetrating.dash_px = 14.0;
  penetrating.right_axis = true;
  if (run.error_mm.sparse_initial) add(sparse, 0, run.error_mm.sparse_initial->mean);
  if (run.error_mm.initial) add(cross, 0, run.error_mm.initial->mean);
  for (const TracePoint& point : run.trace) {
    // Methods that stream no iterates: the error is known before and after.
    const bool last = &point == &run.trace.back();
    const std::optional<MeanStd>& at_cross = last ? run.error_mm.cross : point.cross;
    add(sparse, point.iteration, point.sparse.mean);
    add(cross, point.iteration, at_cross ? at_cross->mean : kGapInLine);
    add(penetrating, point.iteration, point.penetrating);
  }
  spec.series = {sparse};
  if (run.error_mm.cross) spec.series.push_back(cross);
  // Under the fixed boundary nothing can penetrate; a line of zeros would only hide the axis.
  const bool any = std::any_of(run.trace.begin(), run.trace.end(),
                               [](const TracePoint& point) { return point.penetrating > 0; });
  if (any || run.boundary == to_string(Boundary::kContact)) spec.series.push_back(penetrating);

  Figure figure;
  figure.file_name = "convergence-" + group.name + "-" + file_name_from(run.boundary) + ".png";
  figure.caption =
      "Misfit at the sparse data and at the cross-validation points, and number of slave nodes "
      "penetrating the skull, per iteration; " +
      run.scenario + ", " + run.boundary + " boundary (compare Fig. 3 of the paper).";
  figure.image = draw_chart(spec);
  return figure;
}

}  // namespace brainshift::client
