// SPDX-License-Identifier: GPL-3.0-or-later
// What `brainshift stereo` does, from files to files (docs/stereo.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/geometry/surface_check.hpp"
#include "common/stereo/calibrate.hpp"
#include "common/stereo/disparity.hpp"
#include "common/stereo/reconstruct.hpp"

namespace brainshift::client {

// Pictures of a chessboard -> calibration file.
struct CalibrateJob {
  // Files or patterns; as many left as right, paired in order.
  std::vector<std::string> left, right;
  std::string board = "9x6";  // inner corners
  double square_mm = 0.0;
  std::filesystem::path out;
};
// kInvalidArgument for another number of left than right pictures. Other errors: of reading
// pictures, of stereo::calibrate, and of writing. Writes nothing on failure.
Result<stereo::CalibrationResult> calibrate_files(const CalibrateJob& job,
                                                  const Progress& progress = {});

// A pair of pictures -> surface file with the fields sd_mm and confidence, and a picture of the
// disparities if its path is given.
struct ReconstructJob {
  std::filesystem::path left, right, calibration, pose, out, disparity_picture;
  stereo::DepthRange range;
  stereo::ReconstructOptions options;
};
struct ReconstructSummary {
  stereo::ReconstructedSurface made;
  double matched_fraction = 0.0;
};
Result<ReconstructSummary> reconstruct_files(const ReconstructJob& job,
                                             const Progress& progress = {});

// A surface file -> one more observation of a surgery file, which is made if it does not exist.
// The surface must pass geometry/surface_check.hpp against the model's craniotomy.
struct ObserveJob {
  std::filesystem::path surface, model, out;
  double sd_mm = 0.0;
  // Since the surgery's first observation; default: one second after the last one.
  std::optional<double> time_s;
  std::string source = "stereopsis";
};
struct ObserveSummary {
  geometry::CheckedSurface checked;
  std::uint64_t sequence = 0;
  double time_s = 0.0;
};
// kInvalidArgument: sd or time out of range, a surgery of another case or model, a surface that
// fails its check. Other errors: of reading and writing the files.
Result<ObserveSummary> observe_surface(const ObserveJob& job);

}  // namespace brainshift::client
