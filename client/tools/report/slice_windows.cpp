// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/slice_windows.hpp"

namespace brainshift::client {

SliceWindow whole_head(const Points& nodes, const Vec3& through, Plane plane) {
  constexpr double kMargin_mm = 10.0;
  constexpr double kPx_per_mm = 5.0;
  const Vec3 low = nodes.rowwise().minCoeff().array() - kMargin_mm;
  const Vec3 high = nodes.rowwise().maxCoeff().array() + kMargin_mm;
  SliceWindow window{plane, 0.0, low.x(), high.x(), 0.0, 0.0, kPx_per_mm};
  window.offset_mm = through(window.normal_axis());
  window.up_min = low(window.up_axis());
  window.up_max = high(window.up_axis());
  return window;
}

SliceWindow close_up(const Vec3& centre, double half_mm, double px_per_mm, Plane plane) {
  SliceWindow window{plane, 0.0, centre.x() - half_mm, centre.x() + half_mm, 0.0, 0.0, px_per_mm};
  window.offset_mm = centre(window.normal_axis());
  window.up_min = centre(window.up_axis()) - half_mm;
  window.up_max = centre(window.up_axis()) + half_mm;
  return window;
}

}  // namespace brainshift::client
