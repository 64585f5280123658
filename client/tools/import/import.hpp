// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift import`: makes a surgery file from a recording of
// tracked ultrasound (docs/import.md).
//
//   recording, device file, registration --> chain Image -> Probe -> Tracker -> Reference -> Ras
//                                            for every frame
//   contours, or seeds and the tracer    --> boundary points: for every sweep one observation
//                                            (TumourBoundary, "ius")
//   case or model file                   --> case_id, model_id and the place of the tumour
//
// Statistics: every point's error has standard deviation sd_mm and is taken as independent of the
// other points' errors. Errors of calibration and registration are not: they move all points of a
// sweep together, and the daemon's ICP takes them for motion.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/import/import_boundaries.hpp"
#include "client/tools/import/import_case.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"

namespace brainshift::client {

struct ImportOptions {
  std::filesystem::path recording;
  std::filesystem::path device;  // PLUS device set; empty: the recording has every transform
  // Exactly one of each pair must be given.
  std::filesystem::path contours;
  std::filesystem::path seeds;
  std::filesystem::path registration;  // T_ras_reference
  std::filesystem::path fiducials;     // points from which T_ras_reference is computed
  std::filesystem::path case_file;     // its model is built again
  std::filesystem::path model;
  std::filesystem::path out;  // must not exist
  std::string image_frame = "Image";
  std::string reference_frame = "Reference";
  std::string orientation;  // for a recording that does not say
  bool open_contours = false;
  double sd_mm = 0.5;  // of a boundary point
  double latency_ms = 0.0;
  double max_age_ms = 200.0;
  double sweep_gap_s = 0.0;
};

struct ImportedSweep {
  std::uint64_t sequence = 0;
  int first_frame = 0, last_frame = 0, contours = 0;
  Eigen::Index points = 0;
  double extent_mm = 0.0;           // diagonal of the bounding box
  double tumour_distance_mm = 0.0;  // between centroids of boundary and undeformed tumour
};

struct ImportReport {
  int frames = 0, frames_used = 0;
  std::vector<std::string> links;  // the chain
  std::optional<FiducialReport> fiducials;
  std::vector<tracking::Dropped> dropped;
  std::vector<tracking::Dropped> lost_contours;
  std::vector<ImportedSweep> sweeps;
  // What the user should know: defects, where tracing ended, suspicious units.
  std::vector<std::string> notes;
};

// Leaves nothing behind on failure. kInvalidArgument, kNotFound, kUnreadable or kEmptySet for
// input that cannot be used, e.g. a boundary more than 100 mm from the case's tumour; the sentence
// names option, file, frame or field. An `out` that exists is such input. kWriteFailed.
Result<ImportReport> import_recording(const ImportOptions& options, const Progress& progress = {});

// The report as lines for a terminal.
std::vector<std::string> report_lines(const ImportReport& report);

}  // namespace brainshift::client
