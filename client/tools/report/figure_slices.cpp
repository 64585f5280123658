// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/figures.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

#include "client/tools/pictures/canvas.hpp"
#include "client/tools/pictures/sheet.hpp"
#include "client/tools/pictures/slice_panel.hpp"
#include "common/geometry/surface.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::client {
namespace {

constexpr double kCloseUpHalf_mm = 34.0;
constexpr double kCloseUp_px_per_mm = 12.0;
constexpr double kArrowSpacing_mm = 9.0;
constexpr double kMapSpacing_mm = 1.0;
constexpr double kDifferenceFactor = 5.0;  // "magnified five times for visualization", paper Fig. 4

const Stroke kSliceBefore{meaning::kBefore, 3, 12.0};
const Stroke kSliceTrue{meaning::kTrue, 8, 0.0};
const Stroke kSliceEstimated{meaning::kEstimated, 3, 0.0};
const Stroke kSliceSepta{meaning::kSeptum, 5, 0.0, 2};
const Stroke kSliceVentricles{meaning::kVentricle, 3, 0.0};

struct Estimated {
  std::string boundary;
  const Points* displacement = nullptr;
  // 3 x n, their values in the first row; no columns: not told.
  Points known = {}, sd_mm = {};
};

// One group's fields on one mesh.
struct Scene {
  const Head& head;
  const TetMesh& mesh;
  geometry::TetLocator locator;
  TriangleSurface brain;
  std::vector<NodeIndex> node_of_vertex;  // of brain
  const Points* truth = nullptr;
  std::vector<Estimated> estimates;
  std::string scenario;
  std::string method;
};

// Longest projection on the slice: what an arrow shows of a displacement.
double largest_in_plane(const SliceSamples& samples, const Points& field,
                        const SliceWindow& window) {
  double largest = 0.0;
  for (const auto& location : samples.locations) {
    Vec3 u = geometry::value_at(location, field);
    u(window.normal_axis()) = 0.0;
    largest = std::max(largest, u.norm());
  }
  return largest;
}

// 0 where a boundary has no such field.
double largest_on(const SliceSamples& samples, const Points& field) {
  double largest = 0.0;
  if (field.cols() == 0) return largest;
  for (const auto& location : samples.locations)
    largest = std::max(largest, geometry::value_at(location, field).norm());
  return largest;
}

// Up to the next half (or tenth, or hundredth) for a tidy colour scale.
double round_up(double value) {
  if (!(value > 0.0)) return 1.0;
  const double unit = value > 2.0 ? 0.5 : value > 0.2 ? 0.1 : 0.01;
  return std::ceil(value / unit - 1e-9) * unit;
}

// So that the longest arrow spans at least one grid cell.
double arrow_magnification(double largest_mm) {
  for (const double factor : {1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0}) {
    if (factor * largest_mm >= kArrowSpacing_mm) return factor;
  }
  return 8.0;
}

std::string trimmed(double value) {
  return value == std::floor(value) ? fixed_decimals(value, 0) : fixed_decimals(value, 1);
}

SlicePanel background(const Scene& scene, const SliceWindow& window, double brightness) {
  SlicePanel panel(window);
  if (scene.head.mri) panel.draw_mri(*scene.head.mri, brightness);
  return panel;
}

TriangleSurface moved_brain(const Scene& scene, const Points& displacement) {
  TriangleSurface moved = scene.brain;
  moved.vertices += displacement(Eigen::all, scene.node_of_vertex);
  return moved;
}

// The legend names it where any of it lies in the picture.
void draw_named(SlicePanel& panel, Sheet& sheet, const TriangleSurface& surface,
                const LegendEntry& entry) {
  if (panel.draw_section(surface, entry.stroke)) name_in_legend(sheet, entry);
}

void draw_tumour(SlicePanel& panel, Sheet& sheet, const std::string& what, const Scene& scene,
                 const Points& estimate) {
  const TriangleSurface& tumour = scene.head.tumour;
  if (tumour.num_triangles() == 0) return;
  if (scene.truth != nullptr) {
    draw_named(panel, sheet, deformed_surface(tumour, scene.locator, *scene.truth),
               {what + " true", kSliceTrue});
  }
  draw_named(panel, sheet, deformed_surface(tumour, scene.locator, estimate),
             {what + " estimated", kSliceEstimated});
  draw_named(panel, sheet, tumour, {what + " before", kSliceBefore});
}

// Falx, tentorium and ventricles before, where the model has them. After maps and arrows, which
// would hide a sheet.
void draw_anatomy(SlicePanel& panel, Sheet& sheet, const Scene& scene) {
  draw_named(panel, sheet, scene.head.ventricles, {"ventricles before", kSliceVentricles});
  draw_named(panel, sheet, scene.head.septa, {"falx, tentorium", kSliceSepta});
}

std::string slice_name(const Scene& scene, const SliceWindow& window, const char* through) {
  const bool axial = window.plane == Plane::kAxial;
  return "method " + scene.method + "; " + (axial ? "axial" : "coronal") + " slice through the " +
         through + ", " + (axial ? "S = " : "A = ") + fixed_decimals(window.offset_mm, 1) + " mm";
}

cv::Mat shift_sheet(const Scene& scene, Plane plane) {
  const SliceWindow window = whole_head(scene.mesh.nodes, scene.head.craniotomy_centre, plane);
  const SliceSamples samples = sample_slice(scene.locator, window, kArrowSpacing_mm);
  std::vector<const Points*> fields;
  for (const Estimated& e : scene.estimates) fields.push_back(e.displacement);
  if (scene.truth != nullptr) fields.push_back(scene.truth);
  double largest = 0.0;
  double largest_arrow = 0.0;
  for (const Points* field : fields) {
    largest = std::max(largest, largest_on(samples, *field));
    largest_arrow = std::max(largest_arrow, largest_in_plane(samples, *field, window));
  }
  const double magnification = arrow_magnification(largest_arrow);
  Sheet sheet;
  sheet.title = "Brain shift: " + scene.scenario;
  sheet.subtitle = slice_name(scene, window, "craniotomy centre") + "; arrows drawn " +
                   trimmed(magnification) + "x: their part in the plane, coloured by full length";
  sheet.colour_max = round_up(largest);
  sheet.colour_label = "displacement (mm)";
  for (const Estimated& e : scene.estimates) {
    SlicePanel panel = background(scene, window, 0.7);
    panel.draw_arrows(samples, *e.displacement, magnification, sheet.colour_max, false);
    if (scene.truth != nullptr) {
      panel.draw_arrows(samples, *scene.truth, magnification, sheet.colour_max, true);
      name_in_legend(sheet, {"true displacement", {palette::kWhite, 1, 0.0}});
    }
    draw_anatomy(panel, sheet, scene);
    draw_tumour(panel, sheet, "tumour", scene, *e.displacement);
    panel.draw_orientation(20.0);
    panel.draw_gravity(scene.head.gravity_direction);
    sheet.panels.push_back({e.boundary + " boundary", panel.image()});
  }
  return compose(sheet);
}

cv::Mat close_up_sheet(const Scene& scene, Plane plane) {
  const SliceWindow window =
      close_up(scene.head.tumour_centre, kCloseUpHalf_mm, kCloseUp_px_per_mm, plane);
  Sheet sheet;
  sheet.title = "Tumour and brain surface: " + scene.scenario;
  sheet.subtitle = slice_name(scene, window, "tumour centre") + "; displacements at true scale";
  for (const Estimated& e : scene.estimates) {
    SlicePanel panel = background(scene, window, 0.8);
    if (scene.truth != nullptr) {
      draw_named(panel, sheet, moved_brain(scene, *scene.truth), {"outline true", kSliceTrue});
    }
    draw_named(panel, sheet, moved_brain(scene, *e.displacement),
               {"outline estimated", kSliceEstimated});
    draw_named(panel, sheet, scene.brain, {"outline before", kSliceBefore});
    draw_tumour(panel, sheet, "outline", scene, *e.displacement);
    panel.draw_orientation(10.0);
    sheet.panels.push_back({e.boundary + " boundary", panel.image()});
  }
  return compose(sheet);
}

// Differences comparable with the truth itself would cover the slice when magnified.
double difference_factor(double largest_difference_mm, double largest_true_mm) {
  return kDifferenceFactor * largest_difference_mm <= 1.5 * largest_true_mm ? kDifferenceFactor
                                                                            : 1.0;
}

// Precondition: truth.
cv::Mat difference_sheet(const Scene& scene) {
  const SliceWindow window =
      whole_head(scene.mesh.nodes, scene.head.craniotomy_centre, Plane::kAxial);
  const SliceSamples samples = sample_slice(scene.locator, window, kArrowSpacing_mm);
  const double largest = largest_on(samples, *scene.truth);
  const double magnification = arrow_magnification(largest_in_plane(samples, *scene.truth, window));
  Sheet sheet;
  sheet.title = "True displacement and the errors: " + scene.scenario;
  sheet.subtitle = slice_name(scene, window, "craniotomy centre") + "; all arrows drawn " +
                   trimmed(magnification) +
                   "x, differences first multiplied by the factor in their title";
  sheet.colour_max = round_up(largest);
  sheet.colour_label = "length, with the title's factor (mm)";
  const auto add = [&](const std::string& title, const Points& field) {
    SlicePanel panel = background(scene, window, 0.7);
    panel.draw_arrows(samples, field, magnification, sheet.colour_max, false);
    draw_anatomy(panel, sheet, scene);
    panel.draw_orientation(20.0);
    panel.draw_gravity(scene.head.gravity_direction);
    sheet.panels.push_back({title, panel.image()});
  };
  add("true displacement", *scene.truth);
  for (const Estimated& e : scene.estimates) {
    const Points difference = *e.displacement - *scene.truth;
    const double factor = difference_factor(largest_on(samples, difference), largest);
    add(trimmed(factor) + " x (" + e.boundary + " estimate - true)", factor * difference);
  }
  return compose(sheet);
}

// The length of a field on a slice, for each estimate: those that give one. `sheet` has its title
// and the colour scale's label; a scale without an end gets one.
cv::Mat map_sheet(const Scene& scene, const std::function<Points(const Estimated&)>& field_of,
                  Sheet sheet) {
  const SliceWindow window =
      whole_head(scene.mesh.nodes, scene.head.craniotomy_centre, Plane::kAxial);
  const SliceSamples samples = sample_slice(scene.locator, window, kMapSpacing_mm);
  if (sheet.colour_max == 0.0) {
    double largest = 0.0;
    for (const Estimated& e : scene.estimates) {
      largest = std::max(largest, largest_on(samples, field_of(e)));
    }
    sheet.colour_max = round_up(largest);
  }
  sheet.title += ": " + scene.scenario;
  sheet.subtitle =
      slice_name(scene, window, "craniotomy centre") + "; one colour scale for all panels";
  for (const Estimated& e : scene.estimates) {
    const Points field = field_of(e);
    if (field.cols() == 0) continue;
    SlicePanel panel = background(scene, window, 0.9);
    panel.draw_magnitude_map(samples, field, sheet.colour_max, 0.7);
    draw_anatomy(panel, sheet, scene);
    draw_named(panel, sheet, scene.head.tumour, {"tumour before", kSliceBefore});
    panel.draw_orientation(20.0);
    sheet.panels.push_back({e.boundary + " boundary", panel.image()});
  }
  return compose(sheet);
}

Sheet map_of(const char* title, const char* colour_label, double colour_max = 0.0) {
  Sheet sheet;
  sheet.title = title;
  sheet.colour_label = colour_label;
  sheet.colour_max = colour_max;
  return sheet;
}

constexpr double kHalf_mm = 50.0;
constexpr double kPx_per_mm = 6.0;
constexpr double kBar_mm = 20.0;

const Stroke kBefore{meaning::kBefore, 2, 10.0};
const Stroke kTrue{meaning::kTrue, 5, 0.0};
const Stroke kEstimated{meaning::kEstimated, 2, 0.0};

// The tumour before, estimated and, where it is known, true.
struct Outlines {
  TriangleSurface before, estimated;
  std::optional<TriangleSurface> truth;
};

// Where the tissue at a place of the deformed head was; nullopt where no tissue is any more.
class Origin {
 public:
  Origin(const TetMesh& mesh, const geometry::TetLocator& undeformed, const Points& displacement)
      : undeformed_(undeformed), displacement_(displacement), moved_([&] {
          TetMesh moved = mesh;
          moved.nodes += displacement;
          return geometry::TetLocator(moved);
        }()) {}

  std::optional<Vec3> operator()(const Vec3& x) const {
    const geometry::TetLocation at = moved_.locate(x);
    if (at.distance_mm == 0.0) return x - geometry::value_at(at, displacement_);
    if (undeformed_.locate(x).distance_mm == 0.0) return std::nullopt;
    return x;
  }

 private:
  const geometry::TetLocator& undeformed_;
  const Points& displacement_;
  geometry::TetLocator moved_;
};

cv::Mat draw(const SliceWindow& window, const VoxelImage& mri, const Outlines& outlines,
             const SlicePanel::Origin& origin) {
  SlicePanel panel(window);
  panel.draw_mri(mri, 0.9, origin);
  if (outlines.truth) panel.draw_section(*outlines.truth, kTrue);
  panel.draw_section(outlines.estimated, kEstimated);
  panel.draw_section(outlines.before, kBefore);
  panel.draw_orientation(kBar_mm);
  return panel.image();
}

}  // namespace

std::vector<Figure> slice_figures(const RunGroup& group, const std::vector<ReportedRun>& runs,
                                  const Head& head) {
  std::vector<const ReportedRun*> shown;
  for (const auto& index : {group.contact, group.fixed}) {
    if (index && runs[*index].field) shown.push_back(&runs[*index]);
  }
  if (shown.empty()) return {};
  const RunField& first = *shown.front()->field;
  Scene scene{head,
              first.mesh,
              geometry::TetLocator(first.mesh),
              {},
              {},
              nullptr,
              {},
              shown.front()->report.scenario,
              shown.front()->report.method};
  scene.brain = geometry::boundary_surface(first.mesh, &scene.node_of_vertex);
  scene.truth = first.truth ? &*first.truth : nullptr;
  for (const ReportedRun* run : shown) {
    if (run->field->estimated.cols() != first.mesh.num_nodes())
      continue;  // not the same mesh after all
    Estimated& added = scene.estimates.emplace_back();
    added.boundary = run->report.boundary;
    added.displacement = &run->field->estimated;
    for (const auto& [to, from] : {std::pair{&added.known, &run->field->known},
                                   std::pair{&added.sd_mm, &run->field->sd_mm}}) {
      *to = Points::Zero(3, from->size());
      to->row(0) = *from;
    }
  }

  const std::string what =
      scene.scenario + ", method " + scene.method + ", " +
      (scene.estimates.size() > 1 ? "contact and fixed boundary side by side"
                                  : scene.estimates.front().boundary + " boundary");
  std::vector<Figure> figures;
  for (const auto& [plane, infix, shown_in] :
       {std::tuple{Plane::kAxial, "", " (compare Fig. 4a and e)."},
        std::tuple{Plane::kCoronal, "coronal-", " (compare Fig. 4b)."}}) {
    figures.push_back({"shift-" + std::string(infix) + group.name + ".png",
                       "Estimated displacement (coloured arrows) and true displacement (thin "
                       "white) on the MRI, with the tumour's outline before, estimated and true; " +
                           what + shown_in,
                       shift_sheet(scene, plane)});
    figures.push_back({"tumour-" + std::string(infix) + group.name + ".png",
                       "Close-up at the tumour: outlines of tumour and brain surface before, "
                       "estimated and true; " +
                           what + ".",
                       close_up_sheet(scene, plane)});
  }
  const auto add_map = [&](const char* file, const std::string& caption, Points Estimated::*values,
                           Sheet sheet) {
    const bool tells = std::any_of(scene.estimates.begin(), scene.estimates.end(),
                                   [&](const Estimated& e) { return (e.*values).cols() > 0; });
    if (!tells) return;
    figures.push_back(
        {file + group.name + ".png", caption + what + ".",
         map_sheet(
             scene, [&](const Estimated& e) { return e.*values; }, std::move(sheet))});
  };
  add_map("sd-", "How sure the field is: standard deviation of each displacement component; ",
          &Estimated::sd_mm,
          map_of("Standard deviation of the estimate", "standard deviation (mm)"));
  add_map("known-", "Where the field is known: 1, the data say it; 0, it is a guess of the prior; ",
          &Estimated::known, map_of("What the data know", "share of the sd taken away", 1.0));
  if (scene.truth == nullptr) return figures;
  figures.push_back({"difference-" + group.name + ".png",
                     "True displacement, and estimated minus true, magnified as its title says; " +
                         what + " (compare Fig. 4c and d).",
                     difference_sheet(scene)});
  figures.push_back(
      {"error-" + group.name + ".png", "Length of estimated minus true displacement; " + what + ".",
       map_sheet(
           scene, [&](const Estimated& e) -> Points { return *e.displacement - *scene.truth; },
           map_of("Error of the estimate", "|estimated - true| (mm)"))});
  return figures;
}

std::vector<Slide> warped_slices(const RunGroup& group, const std::vector<ReportedRun>& runs,
                                 const Head& head) {
  const ReportedRun* run = nullptr;
  for (const auto& index : {group.fixed, group.contact}) {
    if (index && runs[*index].field) run = &runs[*index];
  }
  if (run == nullptr || !head.mri) return {};
  const RunField& field = *run->field;
  const geometry::TetLocator undeformed(field.mesh);
  Outlines outlines{head.tumour, deformed_surface(head.tumour, undeformed, field.estimated), {}};
  if (field.truth) outlines.truth = deformed_surface(head.tumour, undeformed, *field.truth);
  const Origin of_estimate(field.mesh, undeformed, field.estimated);
  std::optional<Origin> of_truth;
  if (field.truth) of_truth.emplace(field.mesh, undeformed, *field.truth);

  std::vector<Slide> slides;
  for (const auto& [plane, name, axis] :
       {std::tuple{Plane::kAxial, "axial", "S"}, std::tuple{Plane::kCoronal, "coronal", "A"}}) {
    const SliceWindow window = close_up(head.tumour_centre, kHalf_mm, kPx_per_mm, plane);
    Slide slide;
    slide.file_name = std::string("slide-") + name + "-" + group.name;
    slide.caption = run->report.scenario + ", method " + run->report.method + ", " +
                    run->report.boundary + " boundary: the MRI's " + name +
                    " slice through the tumour, " + axis + " = " +
                    fixed_decimals(window.offset_mm, 1) +
                    " mm. Outlines of the tumour: dashed white before, orange estimated" +
                    (field.truth ? ", blue true" : "; no truth is recorded") +
                    ". Black within the head: tissue has left the place.";
    slide.positions.push_back({"before", draw(window, *head.mri, outlines, {})});
    slide.positions.push_back(
        {"estimate", draw(window, *head.mri, outlines, std::cref(of_estimate))});
    if (of_truth) {
      slide.positions.push_back({"truth", draw(window, *head.mri, outlines, std::cref(*of_truth))});
    }
    slides.push_back(std::move(slide));
  }
  return slides;
}

}  // namespace brainshift::client
