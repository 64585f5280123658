// SPDX-License-Identifier: GPL-3.0-or-later
// What users give instead of what was asked for, in one place for every input of a case: masks
// that are not quite masks, labels that were resampled, surfaces with cracks, lengths in metres.
// Each is read right, which a note tells, or refused with a sentence that begins with `what`: the
// key and the file. notes may be null.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::anatomy {

using Notes = std::vector<std::string>;
void add_note(Notes* notes, const std::string& note);

// The end of a note about a `share` (0 to 1) of something that is left out: up to a tenth
// "; nothing to do", else "; look at the PLACE in the pictures, and at the labels there".
std::string what_to_do(double share, const char* place);
// Whether a note ends so that nobody need act.
bool asks_nothing(const std::string& note);

// kInvalidArgument unless the largest side of a box lies between the bounds; the sentence names
// metres or micrometres where those would fit.
Status check_extent(const Vec3& size_mm, const std::string& what, double least_mm, double most_mm);

// A head has 3,000 to 5,000 cc, the largest brains 1,900.
inline constexpr double kLargestBrain_cc = 2500.0;

// The voxels of a brain mask or a skull-stripped image as 1, all others as 0.
//   values > 0                         are brain; one value below 0 (-1) is the background's
//   a soft mask (a third of the voxels above a twentieth of the largest value are within a tenth of
//   it, and values lie between)        brain from half of that value on; noted
//   ripples below 0, of at most a twentieth of the largest value
//                                      brain above as much; noted
//   more below 0                       kInvalidArgument: an image (normalised) and no mask
//   the largest part above kLargestBrain_cc (and within 64,000 cc)
//                                      kInvalidArgument: an image of the whole head (more than 16
//                                      different values), or one turned inside out
// Of several parts the largest counts; the others are noted. kInvalidArgument: a second part of
// more than a tenth of the volume. kEmptySet: no voxel > 0.
Result<VoxelImage> brain_mask(const VoxelImage& image, const std::string& what, Notes* notes);

// A brain_mask that follows the sulci, so that filling gaps narrower than 6 mm adds more than 6 %
// to its volume, with these gaps filled; noted. Any other as it is. The banks of a sulcus lie
// against each other, and bridges between them that are thinner than an element of the mesh would
// turn inside out (docs/decisions/0043-sulci-are-filled.md).
VoxelImage without_sulci(VoxelImage mask, const std::string& what, Notes* notes);

// Focus of a tumour: a 6-connected part of the voxels with one of the labels.
struct Focus {
  VoxelImage mask;  // cut out of the image, with a margin of margin_mm
  double volume_mm3 = 0.0;
  Vec3 centre = Vec3::Zero();
};
// Parts below this are specks, unless there is no larger one.
inline constexpr double kSmallestFocus_mm3 = 50.0;

// Largest first. Noted: several foci, each with volume and place; of several labels each with its
// volume; specks that are left out. A probability map (values 0 to 1, label 1) counts from one
// half on; noted.
// kEmptySet: no voxel has a label; the sentence lists those that are there, with their volumes.
// kInvalidArgument: values that are no whole numbers; all together less than 0.5 or more than
// 250 mm long (check_extent), or above 900 cc.
Result<std::vector<Focus>> tumour_foci(const VoxelImage& image, const std::vector<int>& labels,
                                       double margin_mm, const std::string& what, Notes* notes);

// Numbers of labels are far below; what single precision counts to.
inline constexpr float kLargestLabel = 16777216.0F;
// kInvalidArgument, with figures: a value that is no whole number, or far above any label; an
// image: of more than 60 different values > 0, less than a quarter of the voxels have that of the
// next one (MRIs of 1 mm: 4 to 23 %; label maps of 1 or 2 mm, 33 to 724 labels: 71 to 93 %).
Status check_label_map(const VoxelImage& map, const std::string& what);

// "1 (2.10 cc), 4 (0.31 cc)": the labels of an image but 0, with their volumes; at most 20 of
// them.
std::string listed_labels(const VoxelImage& image);

// kEmptySet, kNotFinite, kInvalidArgument: it has no triangle, a vertex that is not finite, a
// triangle that names a vertex that does not exist.
Status check_surface(const TriangleSurface& surface, const std::string& what);

// A given surface, mended where it is not closed (geometry::mend_surface, 1 micrometre; noted) and
// turned outwards. Errors of check_surface; kInvalidArgument: open edges (counted), triangles that
// are turned against each other, edges of more than two.
Result<TriangleSurface> closed_surface(const TriangleSurface& surface, const std::string& what,
                                       Notes* notes);

}  // namespace brainshift::anatomy
