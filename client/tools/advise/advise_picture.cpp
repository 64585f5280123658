// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <limits>
#include <opencv2/core.hpp>
#include <string>

#include "client/tools/advise/advise.hpp"
#include "client/tools/pictures/canvas.hpp"
#include "client/tools/pictures/sheet.hpp"
#include "client/tools/pictures/surface_view.hpp"
#include "common/io/files/file_access.hpp"
#include "common/registration/surface_distances.hpp"

namespace brainshift::client {
namespace {

constexpr int kNumbered = 5;
constexpr double kMargin_mm = 8.0, kPx_per_mm = 6.0;

// Of the sweep with a place nearest to x; grey without one.
cv::Scalar sweep_colour(const Advised& advised, const Vec3& x, double most_mm) {
  double nearest = std::numeric_limits<double>::infinity();
  cv::Scalar colour = palette::kGrey;
  for (const advice::Advice& one : advised.advice) {
    if (one.candidate.kind != advice::Kind::kSweep || !one.reason.empty()) continue;
    const double distance = (one.candidate.places.colwise() - x).colwise().squaredNorm().minCoeff();
    if (distance >= nearest) continue;
    nearest = distance;
    colour = magnitude_colour(one.reduction_mm() / most_mm);
  }
  return colour;
}

}  // namespace

Status draw_advice(const Advised& advised, const std::filesystem::path& out) {
  const TriangleSurface& tumour = advised.model->tumour;
  const TriangleSurface opening = registration::craniotomy_patch(*advised.model).surface;
  const double most_mm = std::max(1e-3, advised.advice.front().reduction_mm());
  std::vector<cv::Scalar> colours;
  for (int t = 0; t < tumour.num_triangles(); ++t) {
    const Vec3 middle = tumour.vertices(Eigen::all, tumour.triangles.col(t)).rowwise().mean();
    colours.push_back(sweep_colour(advised, middle, most_mm));
  }
  Points shown(3, tumour.num_vertices() + opening.num_vertices());
  shown << tumour.vertices, opening.vertices;
  const Vec3 low = shown.rowwise().minCoeff(), high = shown.rowwise().maxCoeff();
  const Vec3 inside = tumour.vertices.rowwise().mean();
  Vec3 outward = Vec3::UnitZ();
  if (opening.num_vertices() > 0) outward = opening.vertices.rowwise().mean() - inside;

  Sheet sheet;
  sheet.title = "Case " + advised.model->case_id + ": what to measure next";
  sheet.subtitle = "sd at the " + advised.target.name + " now " +
                   fixed_decimals(advised.advice.front().before_mm, 2) +
                   " mm; best: " + advised.advice.front().candidate.name + ", " +
                   fixed_decimals(advised.advice.front().after_mm, 2) + " mm";
  sheet.legend = {
      {"exposed cortex", {palette::kPale, 10, 0.0}},
      {"part of the tumour: a sweep there; disc: a patch or a point", {palette::kGrey, 10, 0.0}}};
  sheet.colour_max = most_mm;
  sheet.colour_label = "less sd at the target, mm";
  const Vec3 side = outward.x() < 0.0 ? Vec3(-Vec3::UnitX()) : Vec3(Vec3::UnitX());
  for (const auto& [towards, name] :
       {std::pair{outward, "from the opening"},
        std::pair{side, side.x() > 0.0 ? "from the patient's right" : "from the patient's left"},
        std::pair{Vec3(Vec3::UnitY()), "from the front"}}) {
    ViewPoint point = view_from(towards, 0.5 * (low + high));
    point.half_width_mm = 0.5 * (high - low).norm() + kMargin_mm;
    point.px_per_mm = kPx_per_mm;
    SurfaceView view(point);
    view.draw_surface(tumour, colours);
    if (opening.num_triangles() > 0) view.draw_through(opening, palette::kPale, 0.35);
    view.draw_axes();
    cv::Mat image = view.image().clone();
    // The best is drawn last, so that nothing hides it.
    for (std::size_t i = advised.advice.size(); i-- > 0;) {
      const advice::Advice& one = advised.advice[i];
      if (!one.reason.empty()) continue;
      const cv::Point2d at = view.pixel(one.candidate.centre());
      if (one.candidate.kind != advice::Kind::kSweep) {
        draw_marker(image, at, Marker::kCircle, palette::kBlack, 12);
        draw_marker(image, at, Marker::kCircle, magnitude_colour(one.reduction_mm() / most_mm), 10);
      }
      if (i >= kNumbered) continue;
      draw_text(image, cv::Point(cvRound(at.x), cvRound(at.y) + 12), std::to_string(i + 1),
                on_picture(26.0, true));
    }
    sheet.panels.push_back({name, image});
  }
  const auto png = encode_png(out.string(), compose(sheet));
  if (!png) return tl::unexpected(png.error());
  return io::write_file(out, *png);
}

}  // namespace brainshift::client
