// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/preview/preview.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <tuple>
#include <utility>

#include "client/tools/pictures/canvas.hpp"
#include "client/tools/pictures/sheet.hpp"
#include "client/tools/pictures/slice_panel.hpp"
#include "client/tools/pictures/surface_view.hpp"
#include "common/geometry/mask.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::client {
namespace {

constexpr double kMargin_mm = 12.0;
constexpr double kSlice_px_per_mm = 4.0;
// A picture of more shows nothing of a head.
constexpr double kFarthest_mm = 500.0;
constexpr std::array kFiles = {"slices-tumour.png", "slices-middle.png", "slices-craniotomy.png",
                               "surface.png", "preview.txt"};

const Stroke kTumour{palette::kOrange, 5, 0.0};
const Stroke kSeptum{meaning::kSeptum, 5, 0.0, 2};
const Stroke kVentricle{meaning::kVentricle, 4, 0.0};
const Stroke kLabels{palette::kYellow, 4, 14.0};
const Stroke kFluidPlane{palette::kBlue, 4, 0.0};
const Stroke kSlavePlane{palette::kBlue, 4, 12.0};

const LegendEntry kPlainBrain{"brain", {palette::kPale, 5, 0.0}};

struct RoleStyle {
  NodeRole role;
  const char* name;
  cv::Scalar colour;
};
const std::array<RoleStyle, 4> kRoles{{{NodeRole::kFixed, "fixed surface", palette::kPale},
                                       {NodeRole::kSlave, "may leave the skull", palette::kSkyBlue},
                                       {NodeRole::kBrainstem, "brainstem", palette::kYellow},
                                       {NodeRole::kCraniotomy, "craniotomy", palette::kPurple}}};
const cv::Scalar& colour_of(NodeRole role) {
  return std::find_if(kRoles.begin(), kRoles.end(),
                      [role](const RoleStyle& style) { return style.role == role; })
      ->colour;
}

// The role that two of the three corners share; the first corner's when all differ.
NodeRole role_of_triangle(const CaseView& view, int triangle) {
  const auto corner = [&](int k) {
    return view.roles[static_cast<std::size_t>(view.brain.triangles(k, triangle))];
  };
  return corner(1) == corner(2) ? corner(1) : corner(0);
}

// Precondition: roles.
bool shows_role(const SurfaceView& picture, const CaseView& view, NodeRole role) {
  for (std::size_t v = 0; v < view.roles.size(); ++v) {
    if (view.roles[v] != role) continue;
    if (picture.shows(view.brain.vertices.col(static_cast<Eigen::Index>(v)))) return true;
  }
  return false;
}

TriangleSurface part_with_role(const CaseView& view, NodeRole role) {
  TriangleSurface part{view.brain.vertices, {}};
  std::vector<int> kept;
  for (int t = 0; t < view.brain.num_triangles(); ++t) {
    if (role_of_triangle(view, t) == role) kept.push_back(t);
  }
  part.triangles = view.brain.triangles(Eigen::all, kept);
  return part;
}

// Bounds of what a picture must show.
class Box {
 public:
  void add(const Points& points) {
    if (points.cols() == 0) return;
    low_ = low_.cwiseMin(points.rowwise().minCoeff());
    high_ = high_.cwiseMax(points.rowwise().maxCoeff());
  }
  void add(const std::optional<VoxelImage>& mask) {
    if (!mask) return;
    geometry::for_each_voxel(
        *mask, [](float v) { return v > 0.0F; }, [this](std::size_t, const Vec3& x) { add(x); });
  }
  void add(const Vec3& x) { low_ = low_.cwiseMin(x), high_ = high_.cwiseMax(x); }
  bool empty() const { return (low_.array() > high_.array()).any(); }
  Vec3 low() const { return low_.array() - kMargin_mm; }
  Vec3 high() const { return high_.array() + kMargin_mm; }
  Vec3 middle() const { return 0.5 * (low_ + high_); }

 private:
  Vec3 low_ = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 high_ = Vec3::Constant(-std::numeric_limits<double>::infinity());
};

// The brain, the tumour, and the brain of a label map unless it is far away; without a brain the
// image too.
Box box_of(const CaseView& view) {
  Box box;
  box.add(view.brain.vertices);
  box.add(view.tumour.vertices);
  for (const auto* mask : {&view.brain_voxels, &view.tumour_voxels}) box.add(*mask);
  if (!box.empty() && view.label_voxels) {
    Box with_labels = box;
    with_labels.add(view.label_voxels);
    if ((with_labels.high() - with_labels.low()).maxCoeff() <= kFarthest_mm) box = with_labels;
  }
  const bool has_brain = view.brain.num_vertices() > 0 || view.brain_voxels;
  if (has_brain || !view.background) return box;
  const auto& dims = view.background->dims;
  for (int corner = 0; corner < 8; ++corner) {
    const auto end = [&](int axis) {
      return (corner >> axis & 1) * (dims[static_cast<std::size_t>(axis)] - 1);
    };
    box.add(Vec3(view.background->T_ras_voxel * Vec3(end(0), end(1), end(2))));
  }
  return box;
}

SliceWindow window_of(const Box& box, Plane plane, const Vec3& through) {
  const Vec3 low = box.low(), high = box.high();
  const double longest = (high - low).maxCoeff();
  SliceWindow window{
      plane, 0.0, 0.0, 0.0, 0.0, 0.0, kSlice_px_per_mm * std::min(1.0, kFarthest_mm / longest)};
  window.offset_mm = through(window.normal_axis());
  window.across_min = low(window.across_axis());
  window.across_max = high(window.across_axis());
  window.up_min = low(window.up_axis());
  window.up_max = high(window.up_axis());
  return window;
}

std::string problem_text(const CaseView& view) {
  return view.problems.empty() ? std::string() : "CANNOT BE PREPARED: " + view.problems.front();
}

std::vector<cv::Scalar> triangle_colours(const CaseView& view) {
  std::vector<cv::Scalar> colours(static_cast<std::size_t>(view.brain.num_triangles()),
                                  palette::kPale);
  if (view.roles.empty()) return colours;
  for (int t = 0; t < view.brain.num_triangles(); ++t) {
    colours[static_cast<std::size_t>(t)] = colour_of(role_of_triangle(view, t));
  }
  return colours;
}

// Adds a panel, and to the legend what can be seen in it.
void add_surface(const CaseView& view, Sheet& sheet, const std::string& title,
                 const Vec3& towards) {
  const Vec3 low = view.brain.vertices.rowwise().minCoeff();
  const Vec3 high = view.brain.vertices.rowwise().maxCoeff();
  ViewPoint point = view_from(towards, 0.5 * (low + high));
  point.half_width_mm = 0.5 * (high - low).norm() / std::sqrt(2.0) + kMargin_mm;
  SurfaceView picture(point);
  picture.draw_surface(view.brain, triangle_colours(view));
  for (const RoleStyle& style : kRoles) {
    if (view.roles.empty()) break;
    if (shows_role(picture, view, style.role)) {
      name_in_legend(sheet, {style.name, {style.colour, 8, 0.0}});
    }
  }
  if (view.roles.empty() && view.brain.num_vertices() > 0) name_in_legend(sheet, kPlainBrain);
  picture.draw_through(view.tumour, palette::kOrange, 0.75);
  if (view.tumour.num_triangles() > 0) {
    name_in_legend(sheet, {"tumour", {palette::kOrange, 10, 0.0}});
  }
  if (!view.roles.empty()) {
    const Vec3 gravity = view.config.gravity_direction.normalized();
    for (const auto& [depth, entry] :
         {std::pair{view.fluid_plane_depth_mm, LegendEntry{"fluid plane", kFluidPlane}},
          std::pair{view.slave_plane_depth_mm, LegendEntry{"second plane", kSlavePlane}}}) {
      for (const auto& line : section_polylines(view.brain, gravity, depth)) {
        if (picture.draw_on_surface(line, entry.stroke)) name_in_legend(sheet, entry);
      }
    }
  }
  picture.draw_axes();
  picture.draw_gravity(view.config.gravity_direction.normalized());
  sheet.panels.push_back({title, picture.image()});
}

namespace fs = std::filesystem;

std::string summary_text(const PreviewSummary& summary) {
  std::string text;
  for (const std::string& line : summary.facts) text += line + "\n";
  for (const std::string& line : summary.doubts) text += "look again: " + line + "\n";
  for (const std::string& line : summary.problems) text += "cannot be prepared: " + line + "\n";
  return text;
}

// Axial, coronal and sagittal plane through a point, mm RAS. place: what is there, for the title.
cv::Mat slices_picture(const CaseView& view, const Vec3& through, const std::string& place) {
  const Box box = box_of(view);
  Sheet sheet;
  sheet.title = "Case " + view.config.case_id + ": planes through the " + place;
  sheet.subtitle = problem_text(view);
  if (sheet.subtitle.empty()) sheet.subtitle = "at " + place_text(through) + "; radiological view";
  for (const auto& [plane, name, letter] :
       {std::tuple{Plane::kAxial, "axial", "S"}, std::tuple{Plane::kCoronal, "coronal", "A"},
        std::tuple{Plane::kSagittal, "sagittal", "R"}}) {
    const SliceWindow window = window_of(box, plane, through);
    SlicePanel panel(window);
    if (view.background) panel.draw_mri(*view.background, 0.8);
    const auto draw = [&](const TriangleSurface& surface, const LegendEntry& entry) {
      if (panel.draw_section(surface, entry.stroke)) name_in_legend(sheet, entry);
    };
    if (view.roles.empty()) {
      draw(view.brain, kPlainBrain);
    } else {
      for (const RoleStyle& style : kRoles) {
        draw(part_with_role(view, style.role), {style.name, {style.colour, 5, 0.0}});
      }
    }
    draw(view.ventricles, {"ventricles", kVentricle});
    draw(view.septa, {"falx, tentorium", kSeptum});
    draw(view.tumour, {"tumour", kTumour});
    const auto draw_voxels = [&](const std::optional<VoxelImage>& mask, const LegendEntry& entry) {
      if (mask && panel.draw_voxels(*mask, entry.stroke)) name_in_legend(sheet, entry);
    };
    draw_voxels(view.brain_voxels, {"voxels of images.brain", kPlainBrain.stroke});
    draw_voxels(view.label_voxels, {"brain of anatomy.labels", kLabels});
    draw_voxels(view.tumour_voxels, {"voxels of the tumour", {palette::kOrange, 3, 0.0}});
    panel.draw_orientation(20.0);
    panel.draw_gravity(view.config.gravity_direction.normalized());
    sheet.panels.push_back(
        {std::string(name) + ", " + letter + " = " + fixed_decimals(window.offset_mm, 1) + " mm",
         panel.image()});
  }
  return compose(sheet);
}

// As seen through the opening, from the tumour's side, and from the front. With the fluid plane and
// the second plane (the paper's section 2.6). Precondition: the brain has a surface.
cv::Mat surface_picture(const CaseView& view) {
  Sheet sheet;
  sheet.title = "Case " + view.config.case_id + ": surface of the brain";
  sheet.subtitle = problem_text(view);
  if (sheet.subtitle.empty())
    sheet.subtitle =
        "the tumour shines through; arrows R, A, S point to the patient's right, front and top";
  const auto opening = opening_of(view);
  const bool left = tumour_centre(view).value_or(Vec3::Zero()).x() < 0.0;
  const Vec3 side = left ? Vec3(-Vec3::UnitX()) : Vec3(Vec3::UnitX());
  if (opening) add_surface(view, sheet, "from the opening", opening->normal);
  add_surface(view, sheet, side.x() > 0.0 ? "from the patient's right" : "from the patient's left",
              side);
  add_surface(view, sheet, "from the front", Vec3::UnitY());
  return compose(sheet);
}

}  // namespace

Result<PreviewSummary> write_preview(const fs::path& case_file, const fs::path& out,
                                     const Progress& progress) {
  const auto view = view_case(case_file, progress);
  std::error_code failed;
  // Those of an earlier run would show another case.
  for (const char* name : kFiles) fs::remove(out / name, failed);
  if (!view) return tl::unexpected(view.error());
  fs::create_directories(out, failed);
  if (failed) return io::write_failed(out, failed.message());
  PreviewSummary summary{facts(*view), doubts(*view), view->problems, {}};
  std::vector<std::pair<std::string, cv::Mat>> pictures;
  if (const auto centre = tumour_centre(*view)) {
    pictures.emplace_back("slices-tumour.png", slices_picture(*view, *centre, "tumour's centre"));
  } else if (const Box box = box_of(*view); !box.empty()) {
    pictures.emplace_back("slices-middle.png",
                          slices_picture(*view, box.middle(), "middle of what there is"));
  }
  if (const auto opening = opening_of(*view)) {
    pictures.emplace_back("slices-craniotomy.png",
                          slices_picture(*view, opening->centre, "craniotomy's centre"));
  }
  if (view->brain.num_vertices() > 0) pictures.emplace_back("surface.png", surface_picture(*view));
  for (const auto& [name, image] : pictures) {
    const auto png = encode_png((out / name).string(), image);
    if (!png) return tl::unexpected(png.error());
    if (Status ok = io::write_file(out / name, *png); !ok) return tl::unexpected(ok.error());
    summary.files.push_back(out / name);
  }
  const fs::path text = out / "preview.txt";
  if (Status ok = io::write_file(text, summary_text(summary)); !ok)
    return tl::unexpected(ok.error());
  summary.files.push_back(text);
  return summary;
}

}  // namespace brainshift::client
