// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/figures.hpp"

#include <algorithm>
#include <limits>

#include "client/tools/pictures/chart.hpp"
#include "client/tools/report/paper_values.hpp"

namespace brainshift::client {
namespace {

constexpr double kGapInLine = std::numeric_limits<double>::quiet_NaN();

}  // namespace

std::optional<Figure> convergence_figure(const RunGroup& group, const RunReport& run) {
  if (run.trace.size() < 2) return std::nullopt;
  ChartSpec spec;
  spec.title = "Convergence: " + run.scenario + ", " + run.boundary + " boundary";
  spec.subtitle = "case " + run.case_id + ", method " + run.method +
                  "; iteration 0 is the misfit of no displacement";
  spec.x = {.label = "iteration", .counts = true, .from_zero = false};
  spec.y.label = "mean misfit (mm)";
  spec.right = {.label = "nodes penetrating the skull", .counts = true};

  const auto series = [](const char* legend, const cv::Scalar& colour, Marker marker) {
    return Series{.legend = legend, .colour = colour, .marker = marker, .line = true, .points = {}};
  };
  const auto add = [](Series& to, int iteration, double value) {
    to.points.push_back({static_cast<double>(iteration), value, ""});
  };
  Series sparse = series("sparse data", palette::kBlue, Marker::kCircle);
  Series cross = series("cross-validation", palette::kPurple, Marker::kSquare);
  Series penetrating = series("penetrating nodes (right)", palette::kInk, Marker::kTriangle);
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

  return Figure{"convergence-" + group.name + "-" + file_name_from(run.boundary) + ".svg",
                "Misfit at the sparse data" +
                    std::string(run.error_mm.cross ? " and at the cross-validation points" : "") +
                    ", and number of slave nodes penetrating the skull, per iteration; " +
                    run.scenario + ", " + run.boundary + " boundary (compare Fig. 3 of the paper).",
                {},
                draw_chart(spec)};
}

std::vector<Figure> course_figures(const RunGroup& group, const RunReport& run) {
  using Value = std::optional<double> CoursePoint::*;
  const bool minutes = !run.course.empty() && run.course.back().time_s > 120.0;
  const auto line = [&](const std::string& legend, const cv::Scalar& colour, Value value) {
    Series series{.legend = legend, .colour = colour, .marker = Marker::kCircle, .line = true};
    for (const CoursePoint& point : run.course) {
      std::string note = point.source + ", " + point.quality;
      if (!point.reason.empty()) note += ": " + point.reason;
      const bool motion = value == &CoursePoint::tumour_mm;
      series.points.push_back({point.time_s / (minutes ? 60.0 : 1.0),
                               (point.*value).value_or(kGapInLine), "",
                               motion ? point.tumour_sd_mm.value_or(0.0) : 0.0, note});
    }
    return series;
  };
  const auto has = [&](Value value) {
    return std::count_if(run.course.begin(), run.course.end(),
                         [&](const CoursePoint& p) { return (p.*value).has_value(); }) > 1;
  };
  struct Strip {
    const char* name;
    const char* label;
    const char* caption;
    Value value;
    const cv::Scalar& colour;
  };
  const Strip strips[] = {
      {"motion", "motion of the tumour (mm)",
       "Mean motion of the tumour's nodes, the band its standard deviation, after every update",
       &CoursePoint::tumour_mm, meaning::kEstimated},
      {"misfit", "misfit (mm)", "Mean misfit at the data, after every update",
       &CoursePoint::misfit_mm, palette::kBlue},
      {"latency", "time of the update (ms)", "From sending an observation to having its update",
       &CoursePoint::latency_ms, palette::kInk}};
  std::vector<Figure> figures;
  for (const Strip& strip : strips) {
    if (!has(strip.value)) continue;
    ChartSpec spec;
    spec.size = {900, 230};
    spec.x.label = minutes ? "time of the observation (min)" : "time of the observation (s)";
    spec.y.label = strip.label;
    const bool truth = strip.value == &CoursePoint::tumour_mm && has(&CoursePoint::true_tumour_mm);
    if (truth) {
      spec.series.push_back(line("true", meaning::kTrue, &CoursePoint::true_tumour_mm));
      spec.series.back().dash_px = 6.0;
    }
    spec.series.push_back(line(truth ? "estimated" : "", strip.colour, strip.value));
    figures.push_back({"course-" + std::string(strip.name) + "-" + group.name + "-" +
                           file_name_from(run.boundary) + ".svg",
                       std::string(strip.caption) + (truth ? "; dashed: the truth" : "") + ".",
                       {},
                       draw_chart(spec)});
  }
  return figures;
}

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

  return Figure{"error-time.svg",
                "Error at the tumour against the time of one update, per method and boundary "
                "condition. The paper's time was measured on a machine of 2009. make bench draws "
                "the same for more methods, ranks and meshes.",
                {},
                draw_chart(spec)};
}

std::optional<Figure> recovery_figure(const std::vector<RunGroup>& groups,
                                      const std::vector<ReportedRun>& runs) {
  if (std::none_of(runs.begin(), runs.end(), [](const ReportedRun& run) {
        return run.report.recovery_pct || run.report.craniotomy_recovery_pct;
      })) {
    return std::nullopt;
  }
  BarSpec spec;
  spec.title = "Share of the deformation recovered";
  spec.subtitle =
      "100 (1 - mean error / mean without correction); craniotomy by closest-point projection "
      "distance";
  spec.y_label = "recovered (%)";
  spec.series = {{"contact boundary", meaning::kContact, {}},
                 {"fixed boundary", meaning::kFixed, {}}};
  spec.reference_legend = "Ji et al. 2009 (simulated case)";
  spec.references.resize(2);

  using Value = std::optional<double> RunReport::*;
  const auto add = [&](const RunGroup& group, const char* place, Value value) {
    const auto of = [&](std::optional<std::size_t> run) {
      return run ? runs[*run].report.*value : std::nullopt;
    };
    const RunReport& any = runs[group.any()].report;
    const bool tumour = value == &RunReport::recovery_pct;
    spec.groups.push_back(any.scenario + "\n" + any.method + "\n" + place);
    spec.series[0].values.push_back(of(group.contact));
    spec.series[1].values.push_back(of(group.fixed));
    std::optional<double> contact;
    std::optional<double> fixed;
    if (any.scenario == "paper") {
      contact = tumour ? paper::kContactRecovery_pct : paper::kContactCraniotomyRecovery_pct;
      if (tumour) fixed = paper::kFixedRecovery_pct;
    } else if (any.scenario == "paper-icp" && tumour) {
      contact = paper::kIcpRecovery_pct;
    }
    spec.references[0].push_back(contact);
    spec.references[1].push_back(fixed);
  };
  for (const RunGroup& group : groups) {
    add(group, "tumour", &RunReport::recovery_pct);
    add(group, "craniotomy", &RunReport::craniotomy_recovery_pct);
  }
  // Worse than doing nothing is possible; one bad value must not flatten all others.
  double lowest = 0.0;
  for (const BarSeries& series : spec.series) {
    for (const auto& value : series.values) lowest = std::min(lowest, value.value_or(0.0));
  }
  spec.y_min = lowest < 0.0 ? std::max(-100.0, 1.1 * lowest - 8.0) : 0.0;
  spec.y_max = 112.0;

  return Figure{
      "recovery.svg",
      "Deformation recovered at the tumour (cross-validation points) and at the craniotomy "
      "(closest-point projection distance), contact against fixed boundary. Ticks: the "
      "paper's simulated case.",
      {},
      draw_bars(spec)};
}

}  // namespace brainshift::client
