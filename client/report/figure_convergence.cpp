// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <limits>

#include "client/plot/chart.hpp"
#include "client/report/figures.hpp"

namespace brainshift::client {
namespace {

constexpr double kGapInLine = std::numeric_limits<double>::quiet_NaN();

}  // namespace

Figure convergence_figure(const RunGroup& group, const RunReport& run) {
  ChartSpec spec;
  spec.title = "Convergence: " + run.scenario + ", " + run.boundary + " boundary";
  spec.subtitle = "case " + run.case_id + ", method " + run.method +
                  "; iteration 0 is the misfit of no displacement";
  spec.x_label = "iteration";
  spec.left_label = "mean misfit (mm)";
  spec.right_label = "nodes penetrating the skull";

  Series sparse{.legend = "sparse data",
                .x = {},
                .y = {},
                .right_axis = false,
                .colour = palette::kBlue,
                .marker = Marker::kCircle,
                .dash_px = 0};
  Series cross{.legend = "cross-validation",
               .x = {},
               .y = {},
               .right_axis = false,
               .colour = palette::kVermillion,
               .marker = Marker::kSquare,
               .dash_px = 0};
  Series penetrating{.legend = "penetrating nodes (right)",
                     .x = {},
                     .y = {},
                     .right_axis = true,
                     .colour = palette::kGreen,
                     .marker = Marker::kTriangle,
                     .dash_px = 14};
  const auto add = [](Series& series, int iteration, double value) {
    series.x.push_back(iteration);
    series.y.push_back(value);
  };
  if (run.error_mm.sparse_initial) add(sparse, 0, run.error_mm.sparse_initial->mean);
  if (run.error_mm.initial) add(cross, 0, run.error_mm.initial->mean);
  for (const TracePoint& point : run.trace) {
    add(sparse, point.iteration, point.sparse.mean);
    add(cross, point.iteration, point.cross ? point.cross->mean : kGapInLine);
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
