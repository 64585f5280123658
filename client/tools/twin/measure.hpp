// SPDX-License-Identifier: GPL-3.0-or-later
// What simulated instruments measure of a known deformation.
#pragma once

#include <array>

#include "client/tools/twin/scenario.hpp"
#include "common/core/mesh.hpp"
#include "common/core/random.hpp"
#include "common/values/observation.hpp"

namespace brainshift::client {

// Adds noise to every column: its magnitude is normally distributed (zero mean, sd_mm), its
// direction uniform (paper 2.6). Per component the standard deviation is sd_mm / sqrt(3).
void add_noise(Points& points, double sd_mm, Random& random);

// The errors of one probe in one surgery, as they are drawn (ProbeErrors in scenario.hpp).
class ProbeError {
 public:
  explicit ProbeError(const ProbeErrors& errors);

  // Whether sweep 0 or 1 crosses a place; share: of the tumour's extent, 0 to 1.
  bool sweeps(int sweep, double share) const;
  // Moves the points of one section: tracker, then calibration. centre: of the turns; probe: where
  // distances count from. Without errors the points stay as they are.
  void disturb(Points& section, const Vec3& centre, const Vec3& probe);

 private:
  ProbeErrors errors_;
  Random tracker_;
  bool from_above_[2];
  Vec3 turn_, shift_;
  double scale_ = 0.0;
};

// Noisy displacements of the given points. undeformed, displacement: 3 x m, mm.
LandmarkPairs measure_displacements(const Points& undeformed, const Points& displacement,
                                    double noise_sd_mm, Random& random);

// Boundary of the deformed tumour on parallel ultrasound planes, in two sweeps at right angles.
// Every plane is parallel to the probe's axis, from the probe to the tumour's centroid. Planes are
// section_spacing_mm apart, points point_spacing_mm apart along each cut; with noise and the
// probe's errors. No point at all where no section of a partial sweep meets the tumour.
TumourBoundary measure_probe_sections(const TriangleSurface& deformed_tumour,
                                      const Vec3& probe_position, const Scenario& scenario,
                                      ProbeError& error, Random& random);

// Two directions across the axis from the probe to the tumour's centroid: normals of the sections
// of the two sweeps.
std::array<Vec3, 2> sweep_normals(const Vec3& centroid, const Vec3& probe_position);

// Points of a deformed piece of cortex, drawn uniformly by area, with noise per component and the
// error of the camera's pose. The result has points only, no triangles.
CorticalSurface measure_cortex(const TriangleSurface& deformed, const CortexView& view,
                               Random& random);

}  // namespace brainshift::client
