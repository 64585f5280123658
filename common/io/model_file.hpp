// SPDX-License-Identifier: GPL-3.0-or-later
// Model file: a BrainModel with the case it came from, HDF5. Written to a temporary name, synced, renamed.
//
// The file begins with a block of 512 bytes, filled up with zeros, that HDF5 tools skip:
//   brainshift model file\nformat 1\nbytes N\ncrc32 XXXXXXXX\n
// N is the size of the whole file, XXXXXXXX the CRC-32 of everything behind the block. It is checked first,
// because the HDF5 library itself is not safe against damaged files.
//
// HDF5 layout (root attributes case_id, model_id, gravity_direction, fluid_plane_depth_mm,
// slave_plane_depth_mm): /case/{yaml, file} the case as case_config_text gives it and the path of its file
// (re-parsed on reading; the file itself is not needed any more), /mesh/{nodes,tets,labels},
// /boundary_triangles, /skull/{vertices,triangles}, /tumour/{vertices,triangles},
// /sets/{craniotomy,brainstem,slaves,fixed}. Points are n x 3 float64, indices int32, text uint8.
// model_id is the hash of the model (common/core/model_id.hpp).
//
// The HDF5 library is not thread-safe: one call at a time in a process.
#pragma once

#include <filesystem>

#include "common/core/brain_model.hpp"
#include "common/core/case_config.hpp"
#include "common/core/error.hpp"

namespace brainshift::io {

struct ModelFile {
  CaseConfig config;
  BrainModel model;
};

// kWriteFailed; kInvalidArgument when model.model_id is not content_hash(model) or the case is not valid.
Status write_model(const std::filesystem::path& path, const ModelFile& file);
// kNotFound; kUnreadable for a file that is not HDF5, truncated, of another version, or whose content does
// not hash to its model_id.
Result<ModelFile> read_model(const std::filesystem::path& path);

}  // namespace brainshift::io
