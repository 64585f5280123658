// SPDX-License-Identifier: GPL-3.0-or-later
// One slice of a head as a picture: MRI, field arrows, magnitude map, outlines.
//
// Radiological view. Axial and coronal slices: the patient's right is on the left of the picture.
// Sagittal slices: anterior is on the left. Anterior (axial) or superior (coronal, sagittal) is up.
// Arrows and maps are sampled on the undeformed slice. An arrow
// begins at the undeformed point and is the projection of the displacement on the slice plane; its
// colour shows the full length of the displacement.
#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "client/tools/pictures/canvas.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"
#include "common/geometry/tet_locator.hpp"

namespace brainshift::client {

enum class Plane {
  kAxial,     // S constant, A up
  kCoronal,   // A constant, S up
  kSagittal,  // R constant, S up
};

// Rectangle of a slice plane, mm RAS. "Across" runs along R (axial, coronal) or A (sagittal), from
// the picture's right edge to its left; "up" along A or S.
struct SliceWindow {
  Plane plane = Plane::kAxial;
  double offset_mm = 0.0;  // the constant coordinate
  double across_min = 0.0, across_max = 0.0, up_min = 0.0, up_max = 0.0;
  double px_per_mm = 5.0;

  int across_axis() const { return plane == Plane::kSagittal ? 1 : 0; }
  int up_axis() const { return plane == Plane::kAxial ? 1 : 2; }
  int normal_axis() const { return 3 - across_axis() - up_axis(); }
  cv::Size size() const;
  cv::Point2d pixel(const Vec3& x_ras) const;
  Vec3 position(cv::Point2d pixel) const;  // in the plane
};

// The slice through `through` that holds all nodes (3 x n) with a margin of 10 mm, 5 px per mm.
SliceWindow whole_head(const Points& nodes, const Vec3& through, Plane plane);
// A square about `centre`, 2 half_mm wide, in the slice through it.
SliceWindow close_up(const Vec3& centre, double half_mm, double px_per_mm, Plane plane);

// Points of a square grid on the slice that lie inside the mesh, with their sampling weights.
struct SliceSamples {
  double spacing_mm = 0.0;
  std::vector<Vec3> positions;
  std::vector<geometry::TetLocation> locations;
};
SliceSamples sample_slice(const geometry::TetLocator& locator, const SliceWindow& window,
                          double spacing_mm);

// The surface with every vertex moved by the field at its undeformed place.
TriangleSurface deformed_surface(const TriangleSurface& surface,
                                 const geometry::TetLocator& locator, const Points& displacement);

// The segments of plane_section, joined end to end. A closed line repeats its first point. Of
// segments that lie on each other, as those of the two sides of a sheet, there is one.
std::vector<std::vector<Vec3>> section_polylines(const TriangleSurface& surface, const Vec3& normal,
                                                 double offset);

class SlicePanel {
 public:
  explicit SlicePanel(const SliceWindow& window);  // black

  // Grey values from black at the 1st percentile of the slice's
  // non-zero values to `brightness` (0 to 1) of white at the 99.5th.
  // With `origin` a place of the slice shows the image at origin(place), in the same greys; nothing
  // where that is null.
  using Origin = std::function<std::optional<Vec3>(const Vec3& x_ras)>;
  void draw_mri(const VoxelImage& mri, double brightness, const Origin& origin = {});
  // Colours the samples' cells by the length of the field; max_mm: the end of the colour scale.
  void draw_magnitude_map(const SliceSamples& samples, const Points& field, double max_mm,
                          double opacity);
  // Arrow = magnification x displacement. `thin` draws hairlines in white instead of colours.
  void draw_arrows(const SliceSamples& samples, const Points& displacement, double magnification,
                   double max_mm, bool thin);
  // True where any of it lies in the picture.
  bool draw_section(const TriangleSurface& surface, const Stroke& stroke);
  // Along the edges of the voxels > 0. True where any of them lies in the picture.
  bool draw_voxels(const VoxelImage& mask, const Stroke& stroke);
  // The letters of the four sides (R and L, or A and P; A and P, or S and I), and a scale bar of
  // `bar_mm`.
  void draw_orientation(double bar_mm);
  // An arrow named "gravity" in the upper left corner (its projection on the slice).
  void draw_gravity(const Vec3& direction);

  const cv::Mat& image() const { return image_; }

 private:
  SliceWindow window_;
  cv::Mat image_;
};

}  // namespace brainshift::client
