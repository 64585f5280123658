// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/evidence_pictures.hpp"

#include <string>
#include <vector>

#include "tests/evidence/evidence_checks.hpp"
#include "tests/evidence/evidence_truths.hpp"
#include "tests/surgeries/dot_chart.hpp"
#include "tests/surgeries/surgery_score.hpp"

namespace brainshift::evidence {
namespace {

using surgeries::Rows;
namespace palette = client::palette;

struct Picture {
  const char* file;
  const char* title;
  const char* data;
  client::Axis y;
  surgeries::RowValue value;
  std::vector<double> bounds;  // dashed
};

struct Dots {
  const char* boundary;
  const char* legend;
  surgeries::Strip strip;
  cv::Scalar colour;
  client::Marker marker;
};

client::Series dots_of(const Rows& rows, const std::vector<std::string>& truths, const Dots& dots,
                       const Picture& picture) {
  client::Series series;
  series.legend = dots.legend;
  series.colour = dots.colour;
  series.marker = dots.marker;
  for (std::size_t t = 0; t < truths.size(); ++t) {
    const Rows of = rows.where("truth", truths[t]).where("boundary", dots.boundary);
    surgeries::add_dots(series, of, t, dots.strip, picture.value);
  }
  return series;
}

Status draw(const Rows& all, const Picture& picture, const std::filesystem::path& folder) {
  const std::vector<std::string> truths = all.values("truth");
  const Rows rows = all.where("data", picture.data);
  client::ChartSpec spec;
  spec.title = picture.title;
  spec.subtitle = "a dot per simulated surgery, patient after patient";
  spec.x.label = "what the truth has and the estimate does not believe";
  spec.x.names = truths;
  spec.x.from_zero = false;
  spec.y = picture.y;
  spec.size = {3400, 1000};  // room for the names
  for (const Dots& dots :
       {Dots{"contact", "contact", {-0.36, -0.04}, palette::kBlue, client::Marker::kCircle},
        Dots{"fixed", "fixed", {0.04, 0.36}, palette::kVermillion, client::Marker::kTriangle}}) {
    spec.series.push_back(dots_of(rows, truths, dots, picture));
  }
  for (std::size_t i = 0; i < picture.bounds.size(); ++i) {
    spec.series.push_back(surgeries::bound_line(
        picture.bounds[i], truths.size(), i == 0 ? "bounds of the means (docs/evidence.md)" : ""));
  }
  return surgeries::write_chart(spec, folder / picture.file);
}

// Mean over the patients' means, as the checks have it.
client::Series reliability_of(const Rows& rows, const char* legend, const cv::Scalar& colour,
                              client::Marker marker) {
  client::Series series;
  series.legend = legend;
  series.colour = colour;
  series.marker = marker;
  series.line = true;
  for (const surgeries::Interval& interval : surgeries::kIntervals) {
    const std::string column = "coverage_" + std::to_string(interval.percent);
    series.points.push_back(
        {static_cast<double>(interval.percent), 100.0 * patient_mean(rows, column.c_str()), ""});
  }
  return series;
}

Status draw_reliability(const Rows& all, const std::filesystem::path& folder) {
  const Rows joint = all.where("boundary", "contact").where("data", "tumour+cortex");
  const auto of = [&](auto wanted) {
    return joint.where(
        [&](const Rows& rows, std::size_t i) { return wanted(rows.text(i, "truth")); });
  };
  client::ChartSpec spec;
  spec.title = "How often the truth lies in the published intervals";
  spec.subtitle = "contact, updates from tumour and cortex; mean over patients, all nodes";
  spec.x = {.label = "share that the interval promises (%)", .from_zero = false};
  spec.y = {.label = "share of true components inside (%)", .from_zero = false};
  spec.size = {1400, 1100};
  client::Series promised;
  promised.legend = "as promised";
  promised.colour = palette::kInk;
  promised.marker = client::Marker::kNone;
  promised.line = true;
  promised.dash_px = 10.0;
  promised.points = {{50.0, 50.0, ""}, {99.0, 99.0, ""}};
  spec.series = {promised};
  const auto add = [&](const Rows& rows, const char* legend, const cv::Scalar& colour,
                       client::Marker marker) {
    if (!rows.empty()) spec.series.push_back(reliability_of(rows, legend, colour, marker));
  };
  add(of([](const std::string& truth) { return truth == "consistency"; }), "consistency",
      palette::kBlue, client::Marker::kCircle);
  add(of(is_adverse_alone), "one adverse ingredient", palette::kGreen, client::Marker::kSquare);
  add(of([](const std::string& truth) { return truth == "all"; }), "all of them",
      palette::kVermillion, client::Marker::kTriangle);
  add(of([](const std::string& truth) { return truth == "calculix"; }), "CalculiX",
      palette::kPurple, client::Marker::kSquare);
  return surgeries::write_chart(spec, folder / "evidence-reliability.png");
}

}  // namespace

Status draw_evidence(const Rows& rows, const std::filesystem::path& folder) {
  const auto column = [](const char* name) {
    return [name](const Rows& of, std::size_t i) { return of.number(i, name); };
  };
  const Picture pictures[] = {
      {"evidence-tumour.png",
       "Left of the tumour's motion, updates from the tumour alone",
       "tumour",
       {.label = "error / motion (%)", .log = true},
       [](const Rows& of, std::size_t i) { return 100.0 - of.number(i, "recovered_pct"); },
       {5.0, 12.0, 20.0}},
      {"evidence-craniotomy.png",
       "Closest point distance at the craniotomy, updates from the tumour alone",
       "tumour",
       {.label = "CPPD (mm)", .log = true},
       column("cppd_mm"),
       {1.0}},
      {"evidence-coverage.png",
       "Coverage of the 90 % interval, updates from tumour and cortex",
       "tumour+cortex",
       {.label = "share of true components inside"},
       column("coverage_90"),
       {0.75, 0.97}}};
  for (const Picture& picture : pictures) {
    if (Status ok = draw(rows, picture, folder); !ok) return ok;
  }
  return draw_reliability(rows, folder);
}

}  // namespace brainshift::evidence
