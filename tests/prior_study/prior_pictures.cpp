// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/prior_study/prior_pictures.hpp"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>

#include "client/tools/pictures/chart.hpp"
#include "common/core/statistics.hpp"

namespace brainshift::prior_study {
namespace {

namespace palette = client::palette;
using client::Marker;

// Logarithmic axes begin here or above; what moves less is drawn at the edge.
constexpr double kLeast_mm = 0.02;
const char* const kTitles[kPlaces] = {"Cortex, centre of the craniotomy", "Tumour, centroid",
                                      "Far side, opposite cortex"};

Status save(const cv::Mat& image, const std::filesystem::path& file) {
  if (cv::imwrite(file.string(), image)) return {};
  return fail(ErrorCode::kWriteFailed, file.string() + ": cannot be written");
}

client::Series line(const cv::Scalar& colour) {
  client::Series series;
  series.colour = colour;
  series.line = true;
  series.marker = Marker::kNone;
  return series;
}

// "along_gravity" -> "along g": names stand side by side.
std::string short_name(std::string part) {
  const std::pair<const char*, const char*> shorter[] = {{"_gravity", " g"}, {"_volume", " vol."}};
  for (const auto& [text, instead] : shorter) {
    const std::size_t at = part.find(text);
    if (at != std::string::npos) part.replace(at, std::string(text).size(), instead);
  }
  return part;
}

// Bracket as a line, target as a square in it. That of the far side rests on no series.
void add_targets(const std::vector<Target>& targets, int place, client::ChartSpec& spec) {
  const std::string origin = place == 2 ? "judgement" : "published";
  bool first = true;
  for (const double quantile : kTargetQuantiles) {
    const Target* target = find_target(targets, place, quantile);
    if (target == nullptr) continue;
    client::Series bracket = line(palette::kVermillion);
    bracket.legend = first ? origin + ": bracket" : "";
    for (const double x : {std::max(kLeast_mm, target->low_mm), target->high_mm}) {
      bracket.points.push_back({x, quantile, ""});
    }
    client::Series value;
    value.colour = palette::kVermillion;
    value.marker = Marker::kSquare;
    value.legend = first ? origin + ": target" : "";
    value.points = {{target->target_mm, quantile, ""}};
    spec.series.push_back(std::move(bracket));
    spec.series.push_back(std::move(value));
    first = false;
  }
}

cv::Mat panel(const PartDraws& total, const std::vector<Target>& targets, int place) {
  const auto p = static_cast<std::size_t>(place);
  client::ChartSpec spec;
  spec.title = kTitles[place];
  spec.subtitle = std::to_string(total.motion_mm[p].size()) + " brains drawn from the prior";
  spec.x = {.label = "motion (mm)", .log = true};
  spec.y = {.label = "draws that move less (%)"};
  spec.size = {1100, 1000};
  client::Series share = line(palette::kBlue);
  share.legend = "prior";
  std::vector<double> motion = total.motion_mm[p];
  std::sort(motion.begin(), motion.end());
  for (std::size_t i = 0; i < motion.size(); ++i) {
    share.points.push_back(
        {std::max(kLeast_mm, motion[i]),
         100.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(motion.size()), ""});
  }
  client::Series quantiles;
  quantiles.legend = "its 5, 50, 95 %";
  quantiles.colour = palette::kBlue;
  for (const double q : kTargetQuantiles) {
    quantiles.points.push_back({std::max(kLeast_mm, percentile(motion, q)), q, ""});
  }
  add_targets(targets, place, spec);
  spec.series.push_back(std::move(share));
  spec.series.push_back(std::move(quantiles));
  return client::draw_chart(spec);
}

cv::Mat parts_chart(const std::vector<PartDraws>& all) {
  const cv::Scalar colours[kPlaces] = {palette::kBlue, palette::kVermillion, palette::kGreen};
  const Marker markers[kPlaces] = {Marker::kCircle, Marker::kTriangle, Marker::kSquare};
  client::ChartSpec spec;
  spec.title = "Motion by each part of the prior alone";
  spec.subtitle = "marker: median of the draws; line: 5 to 95 %";
  spec.x.label = "part of the prior";
  spec.x.from_zero = false;
  spec.y = {.label = "motion (mm)", .log = true};
  spec.size = {2400, 1000};
  for (const PartDraws& part : all) spec.x.names.push_back(short_name(part.part));
  for (int place = 0; place < kPlaces; ++place) {
    client::Series medians;
    medians.legend = kPlaceNames[static_cast<std::size_t>(place)];
    medians.colour = colours[place];
    medians.marker = markers[place];
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::vector<double>& motion = all[i].motion_mm[static_cast<std::size_t>(place)];
      const double x = static_cast<double>(i) + 0.22 * (place - 1);
      const auto at = [&](double q) { return std::max(kLeast_mm, percentile(motion, q)); };
      medians.points.push_back({x, at(50.0), ""});
      client::Series range = line(colours[place]);
      range.points = {{x, at(5.0), ""}, {x, at(95.0), ""}};
      spec.series.push_back(std::move(range));
    }
    spec.series.push_back(std::move(medians));
  }
  return client::draw_chart(spec);
}

}  // namespace

Status draw_pictures(const std::vector<PartDraws>& all, const std::vector<Target>& targets,
                     const std::filesystem::path& folder) {
  std::vector<cv::Mat> panels;
  for (int place = 0; place < kPlaces; ++place) {
    panels.push_back(panel(all.front(), targets, place));
  }
  cv::Mat sheet;
  cv::hconcat(panels, sheet);
  if (Status ok = save(sheet, folder / "prior-predictive.png"); !ok) return ok;
  return save(parts_chart(all), folder / "prior-parts.png");
}

}  // namespace brainshift::prior_study
