// SPDX-License-Identifier: GPL-3.0-or-later
// Model file: a BrainModel with the case it came from and its condensed operators, HDF5. Written
// to a temporary name, synced, renamed: a reader finds the old file or the new one.
//
// The file begins with a block of 512 bytes, filled up with zeros, that HDF5 tools skip:
//   brainshift model file\nformat 7\nbytes N\ncrc32 XXXXXXXX\n
// N is the size of the whole file, XXXXXXXX the CRC-32 of everything behind the block. It is
// checked first, because the HDF5 library itself is not safe against damaged files.
//
// HDF5 layout. Shapes are rows x columns of the data set; n nodes, r modes, s slaves, c control
// nodes, e nodes of the region. Points are n x 3 float64, indices int32, text uint8, all
// little-endian; data sets are contiguous, not compressed.
//   root attributes  case_id, model_id, gravity_direction, fluid_plane_depth_mm,
//                    slave_plane_depth_mm
//   /case/{yaml, file}  the case as case_config_text gives it and the path of its file. The text is
//                       parsed again on reading; the file itself is not needed any more.
//   /inputs/KEY         one group per input, attributes path, bytes (uint64), crc32 (uint32);
//                       model_inputs.hpp
//   /mesh/{nodes,tets,labels}, /boundary_triangles, /skull/{vertices,triangles},
//   /tumour/{vertices,triangles}, /sets/{craniotomy,brainstem,slaves,fixed}
//   /anatomy/{septum_slaves,septum_normals,septum_triangles,ventricle_wall}, attribute
//                       septum_gap_mm; where the model has septa or ventricles
//   /tumour_distance  attributes origin_mm (3), spacing_mm, dims (3); the model may have none
//     values_mm               dims 1*2*3  float32  signed distance, values/distance_grid.hpp
//   /condensed/contact, /condensed/fixed  either, both or none; attributes model_id, prepare_s
//                                         (float64, s), PART_modes (int32) for each part of the
//                                         prior (to_string(PriorPart))
//     responses/              group: [U G] with r + s columns, operators/compact_columns.hpp
//       steps                 r + s       float32         mm, then mm/N
//       order                 n           int32
//       blocks                any x 3     int32
//       wide_basis            any         float32
//       basis                 any         int16
//       basis_scales          any         float32
//       lengths               any         int8
//       longs                 any         int32
//       words                 any         int16
//       bytes                 any         int8
//     compliance_lower        s(s+1)/2    float64  mm/N   Phi: lower triangle, by columns
//     slave_modes             r x s       float64  mm     N^T U, one mode per row
//     slave_normals           s x 3       float64
//     initial_penetration_mm  s           float64
//     slaves                  s           int32
//     region                  e           int32    sorted
//     region_responses        r + s x 3e  float32         rows of [U G] at the region, by columns
//     control                 c           int32    sorted
//     truncated_variance_mm2  4 x c       float64           one residual field per row
//     control_neighbours      n x 4       int32    into control; 0 x 4 without control nodes
//     control_weights         n x 4       float32
// model_id is the hash of the model (common/values/model_id.hpp).
//
// The HDF5 library is not thread-safe: one call at a time in a process.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/configuration/case_config.hpp"
#include "common/core/error.hpp"
#include "common/io/model/model_inputs.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::io {

struct ModelFile {
  CaseConfig config;
  BrainModel model;
  std::vector<CondensedOperators> condensed = {};  // none, one or two: contact, then fixed
  std::vector<InputFile> inputs = {};              // record_inputs, sorted by key
};

// kWriteFailed; kInvalidArgument when model.model_id is not content_hash(model), the case or the
// distance grid is not valid, or operators do not fit the model or are not finite (the sentence
// names the array).
Status write_model(const std::filesystem::path& path, const ModelFile& file);
// kNotFound; kUnreadable, with the reason, for a file that is no model file, of another format,
// truncated, altered, whose content does not hash to its model_id or whose operators do not fit
// the model. operators: the boundary conditions whose operators are read; what the file lacks is
// not missed.
Result<ModelFile> read_model(const std::filesystem::path& path,
                             const std::vector<Boundary>& operators = {Boundary::kContact,
                                                                       Boundary::kFixed});
// The operators of this model for one boundary condition; empty: the file has none. Errors as
// above, also when the file holds another model by now.
Result<std::optional<CondensedOperators>> read_operators(const std::filesystem::path& path,
                                                         const BrainModel& model,
                                                         Boundary boundary);

// What a model written to a path would replace.
struct OldModel {
  std::string case_id, model_id;  // empty where `unreadable` is not
  std::string unreadable;         // why it cannot be read: damaged, or of another format
};
// Nothing where no file is. kInvalidArgument: a file that does not begin as model files do; it is
// somebody else's, and no model is to be written in its place.
Result<std::optional<OldModel>> model_to_replace(const std::filesystem::path& path);

}  // namespace brainshift::io
