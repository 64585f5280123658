// SPDX-License-Identifier: GPL-3.0-or-later
// What simulated instruments measure of a known deformation.
#pragma once

#include "client/twin/scenario.hpp"
#include "common/core/mesh.hpp"
#include "common/values/observation.hpp"
#include "common/core/random.hpp"

namespace brainshift::client {

// Adds noise of normally distributed magnitude (zero mean, sd_mm) and uniform direction to every column
// (paper 2.6). Per component the standard deviation is sd_mm / sqrt(3).
void add_noise(Points& points, double sd_mm, Random& random);

// Noisy displacements of the chosen points. undeformed, displacement: 3 x m.
LandmarkPairs measure_displacements(const Points& undeformed, const Points& displacement,
                                    double noise_sd_mm, Random& random);

// Boundary of the deformed tumour on parallel ultrasound planes: two sweeps at right angles, every plane
// holding the probe's axis (from the craniotomy centre to the tumour centroid), `section_spacing_mm` apart;
// points `point_spacing_mm` apart along the cut, with noise.
TumourBoundary measure_probe_sections(const TriangleSurface& deformed_tumour,
                                      const Vec3& probe_position, const Scenario& scenario,
                                      Random& random);

// Points of a deformed piece of cortex, drawn by area, with noise per component and the error of the camera's pose. No
// triangles: what is measured is points.
CorticalSurface measure_cortex(const TriangleSurface& deformed, const CortexView& view,
                               Random& random);

}  // namespace brainshift::client
