// SPDX-License-Identifier: GPL-3.0-or-later
// Label maps by FreeSurfer's numbers (aseg, aparc+aseg, SynthSeg): which structure a label is, and
// the brain's mask.
// Source: FreeSurfer's FreeSurferColorLUT.txt.
#pragma once

#include <map>
#include <string>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"

namespace brainshift::anatomy {

// kFluid: cerebrospinal fluid outside the ventricles (24). kOther: background, skull, scalp, and
// numbers that no FreeSurfer program gives to a part of the brain.
enum class Structure { kOther, kCerebrum, kCerebellum, kBrainstem, kVentricle, kFluid };
Structure structure_of(int label);

// Of a label of the cerebrum. Nuclei are grey matter that is no cortex. kNone: the callosum,
// lesions and other labels that both hemispheres share.
enum class Side { kNone, kLeft, kRight };
enum class Matter { kCortex, kNucleus, kWhite };
Side side_of(int label);
Matter matter_of(int label);

// Numbers of the AAL atlas (1 to 116, odd left, even right) to FreeSurfer's of the same structure
// and side: cortex, nuclei, cerebellar cortex. Other numbers become 0.
// Source: Tzourio-Mazoyer et al. 2002, NeuroImage 15:273.
VoxelImage with_freesurfer_numbers_of_aal(VoxelImage map);

// The labels of a map with names of its own (BIDS's *_dseg.tsv), renumbered: a name that is
// FreeSurfer's ("Brain-Stem", in any case, without regard to blanks, hyphens and underscores) has
// FreeSurfer's number, every other becomes 0. kInvalidArgument: no name is FreeSurfer's.
Result<VoxelImage> with_freesurfer_numbers(const VoxelImage& map,
                                           const std::map<int, std::string>& names);

// 1 where the map has cerebrum, cerebellum, brainstem or a ventricle, and in sulci: where the fluid
// (24) or background lies in gaps up to about 2 closing_mm wide between them; else 0.
// kInvalidArgument: no voxel has a label of the brain, or no two structures of cerebrum, cerebellum
// and brainstem are there: not FreeSurfer's numbers, and the sentence lists the labels; or the mask
// has more than kLargestBrain_cc (given_inputs.hpp).
Result<VoxelImage> brain_from_labels(const VoxelImage& map, double closing_mm = 3.0);

}  // namespace brainshift::anatomy
