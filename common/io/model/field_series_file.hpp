// SPDX-License-Identifier: GPL-3.0-or-later
// The fields of a surgery as one HDF5 file, for h5py, MATLAB and the like.
//
//   /                             attributes: frame "RAS", length_unit "mm", case_id, model_id
//   /mesh/nodes_mm                n x 3 doubles, undeformed places
//   /mesh/tets                    m x 4 integers, node indices from 0
//   /updates/000012/displacement_mm   n x 3 floats, from undeformed to deformed place
//   /updates/000012/{sd_mm,known}     n floats each, where the update has them; known has no unit
//   /updates/000012               attributes: time_s, sequence, observation_sequence, status,
//                                 quality
//
// Texts are arrays of bytes, as in model files. Fields are written as they are added; the file
// appears whole, or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "common/core/error.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::io {

class FieldSeriesFile {
 public:
  // kWriteFailed, also when `path` is a device or the like.
  static Result<FieldSeriesFile> create(const std::filesystem::path& path, const BrainModel& model);
  FieldSeriesFile(FieldSeriesFile&&) noexcept;
  FieldSeriesFile& operator=(FieldSeriesFile&&) = delete;
  ~FieldSeriesFile();

  // Precondition: a displacement for every node of the model, and another sequence each time.
  Status add(const Update& update, double time_s);
  // The file is there now. Nothing may be added any more.
  Status commit();

 private:
  struct Impl;
  explicit FieldSeriesFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace brainshift::io
