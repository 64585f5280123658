// SPDX-License-Identifier: GPL-3.0-or-later
// What of a case can be looked at before it is prepared, and what in it looks wrong.
//
// A case that cannot be prepared is shown as far as it goes, because a picture of a tumour outside
// the brain tells more than the sentence.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/progress.hpp"
#include "common/core/types.hpp"

namespace brainshift::client {

// What a node of the brain's surface is to the mechanics (the paper's section 2.6).
enum class NodeRole { kFixed, kSlave, kCraniotomy, kBrainstem };

struct CaseView {
  CaseConfig config;
  std::optional<VoxelImage> background;  // the MRI, else the image of the brain
  TriangleSurface tumour;                // empty when it cannot be made
  TriangleSurface brain;                 // the mesh's surface; empty when there is no mesh
  TriangleSurface septa, ventricles;     // falx and tentorium; walls; empty without labels
  int nodes = 0;                         // of the mesh
  int tets = 0;
  std::vector<NodeRole> roles;  // of the brain's vertices; empty when no sets can be selected
  // From craniotomy.centre_mm to the brain's surface, mm; 0 when there is no brain.
  double projection_mm = 0.0;
  // Along gravity, mm; with roles only.
  double fluid_plane_depth_mm = 0.0;
  double slave_plane_depth_mm = 0.0;
  // Of a case that cannot be prepared: 1 where the tumour and the brain are of which no surface can
  // be made, and, where anatomy.labels is to blame, where the brain of that map is.
  std::optional<VoxelImage> tumour_voxels, brain_voxels, label_voxels;
  // Of images.brain: what hangs on the rest by a thin neck (anatomy::mask_leak).
  double leak_mm3 = 0.0;
  Vec3 leak_centre = Vec3::Zero();
  // What the builder made of the inputs (anatomy::build_brain_model).
  std::vector<std::string> notes;
  // Each ends the preparation of the case.
  std::vector<std::string> problems;
};

// Errors: of reading the case, or its MRI, or when none of its images can be read. Whatever else is
// wrong is a problem.
Result<CaseView> view_case(const std::filesystem::path& case_file, const Progress& progress = {});

// Mean of a surface's vertices.
Vec3 centre_of(const TriangleSurface& surface);
// Of its surface, or else of its voxels. None where there is neither.
std::optional<Vec3> tumour_centre(const CaseView& view);
// Where the head is opened: means over the craniotomy's nodes. Without roles, the vertex nearest to
// craniotomy.centre_mm.
struct OpeningView {
  Vec3 centre = Vec3::Zero();  // mm RAS
  Vec3 normal = Vec3::Zero();  // out of the head; unit
};
// Empty when the brain's surface is farther away than half the craniotomy's long axis.
std::optional<OpeningView> opening_of(const CaseView& view);

// "left 46, posterior 47, superior 9 mm".
std::string place_text(const Vec3& x_ras);
// The components of a direction, largest first, without those below 0.05:
// "inferior 0.92, anterior 0.35, left 0.20".
std::string direction_text(const Vec3& direction);

// What the pictures show, as sentences with figures: sizes, places, distances, angles; and what the
// builder noted that asks nothing of anybody (anatomy::asks_nothing).
std::vector<std::string> facts(const CaseView& view);

// How well the brain's surface lies in a T1 MRI: there the brain, 3 mm below the surface, is
// brighter than what is around it, 3 mm above.
struct MriFit {
  double contrast = 0.0;  // mean below less mean above, over the median below
  double dark = 0.0;      // share of the places below that are darker than 0.3 of the median
};
// None without MRI or without brain. Colin27 in its place: about 0.5 and 0.00; 10 mm beside it 0.17
// and 0.05; 30 mm beside it 0.05 and 0.18.
std::optional<MriFit> fit_of_mri(const CaseView& view);

// What is unusual enough for a second look: each a sentence that names the key to look at. A wrong
// side, a wrong axis and metres for millimetres show here.
//   what else the builder noted: a tumour that sticks out of the brain and is cut
//   tumour and opening on different sides of the brain, each more than 10 mm from its middle
//   an opening farther than 60 mm from the tumour's surface
//   an opening that faces down: the brain would sag out of it
//   craniotomy.centre_mm farther than 10 mm from the surface that it is projected to; centimetres
//   where ten times the centre lies on it
//   a brain not between 100 and 220 mm long, or not of 900 to 1900 cc
//   a mask that has leaked (anatomy::mask_leak: above 5 cc)
//   a brain that is not in its place in the MRI (fit_of_mri: contrast below 0.2, or more than
//   0.15 dark)
//   a brainstem above the brain's centre
//   a tumour that takes more than a tenth of the brain's volume
//   fewer slaves than a hundredth of the surface's nodes
std::vector<std::string> doubts(const CaseView& view);

}  // namespace brainshift::client
