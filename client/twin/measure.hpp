// SPDX-License-Identifier: GPL-3.0-or-later
// What simulated instruments measure of a known deformation.
#pragma once

#include "client/twin/scenario.hpp"
#include "common/core/mesh.hpp"
#include "common/core/random.hpp"
#include "common/values/observation.hpp"

namespace brainshift::client {

// Adds noise to every column: its magnitude is normally distributed (zero mean, sd_mm), its
// direction uniform (paper 2.6). Per component the standard deviation is sd_mm / sqrt(3).
void add_noise(Points& points, double sd_mm, Random& random);

// Noisy displacements of the given points. undeformed, displacement: 3 x m, mm.
LandmarkPairs measure_displacements(const Points& undeformed, const Points& displacement,
                                    double noise_sd_mm, Random& random);

// Boundary of the deformed tumour on parallel ultrasound planes, in two sweeps at right angles.
// Every plane is parallel to the probe's axis, from the probe to the tumour's centroid. Planes are
// section_spacing_mm apart, points point_spacing_mm apart along each cut; with noise.
TumourBoundary measure_probe_sections(const TriangleSurface& deformed_tumour,
                                      const Vec3& probe_position, const Scenario& scenario,
                                      Random& random);

// Points of a deformed piece of cortex, drawn uniformly by area, with noise per component and the
// error of the camera's pose. The result has points only, no triangles.
CorticalSurface measure_cortex(const TriangleSurface& deformed, const CortexView& view,
                               Random& random);

}  // namespace brainshift::client
