// SPDX-License-Identifier: GPL-3.0-or-later
// One view of surfaces from outside, as a picture: parallel projection, nearer parts hide farther
// ones, shaded by the angle to the line of sight.
//
// Lengths are mm RAS; a pixel is 1 / px_per_mm. The picture's x axis points along up x towards.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "client/tools/pictures/canvas.hpp"
#include "common/core/mesh.hpp"
#include "common/core/types.hpp"

namespace brainshift::client {

struct ViewPoint {
  Vec3 towards = Vec3::UnitZ();  // from the head to the eye; any length but 0
  Vec3 up = Vec3::UnitY();       // up in the picture; not along `towards`
  Vec3 centre = Vec3::Zero();    // in the middle of the picture
  double half_width_mm = 110.0;
  double px_per_mm = 3.0;
};

// The view from a direction with S up, or with A up where it is nearly along S.
ViewPoint view_from(const Vec3& towards, const Vec3& centre);

class SurfaceView {
 public:
  // A square black picture. Precondition: towards and up are not parallel.
  explicit SurfaceView(const ViewPoint& point);

  // `colours`: one per triangle. Triangles that face away are drawn too, in the same colours.
  void draw_surface(const TriangleSurface& surface, const std::vector<cv::Scalar>& colours);
  // Laid over what is drawn already, hidden by nothing: how a tumour inside is shown. opacity 0..1.
  void draw_through(const TriangleSurface& surface, const cv::Scalar& colour, double opacity);
  // Only the parts within `tolerance_mm` of what is nearest to the eye are drawn.
  // True where there is such a part.
  bool draw_on_surface(const std::vector<Vec3>& line, const Stroke& stroke,
                       double tolerance_mm = 2.0);
  // Whether a place is in the picture, with nothing more than `tolerance_mm` before it.
  bool shows(const Vec3& x_ras, double tolerance_mm = 2.0) const;
  // Arrows along R, A and S with their letters, in the lower left corner.
  void draw_axes();
  // As on slices: an arrow named "gravity" in the upper left corner.
  void draw_gravity(const Vec3& direction);

  // Pixel and depth towards the eye, mm.
  cv::Point2d pixel(const Vec3& x_ras) const;
  double depth(const Vec3& x_ras) const;
  const cv::Mat& image() const { return image_; }

 private:
  cv::Point2d direction_pixels(const Vec3& direction) const;
  ViewPoint point_;
  Vec3 right_, up_, towards_;  // of the picture; orthonormal
  cv::Mat image_;
  cv::Mat_<float> nearest_;  // depth of what is drawn, mm
};

}  // namespace brainshift::client
