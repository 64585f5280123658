// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/warped_slices.hpp"

#include <functional>
#include <tuple>
#include <utility>

#include "client/tools/pictures/slice_panel.hpp"
#include "client/tools/pictures/ticks.hpp"
#include "client/tools/report/slice_windows.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::client {
namespace {

constexpr double kHalf_mm = 50.0;
constexpr double kPx_per_mm = 6.0;
constexpr double kBar_mm = 20.0;

const Stroke kBefore{palette::kWhite, 2, 10.0};
const Stroke kTrue{palette::kSkyBlue, 5, 0.0};
const Stroke kEstimated{palette::kOrange, 2, 0.0};

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
