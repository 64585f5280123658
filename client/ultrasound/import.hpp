// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift import`: a recording of tracked ultrasound to a surgery file that the daemon replays (docs/import.md).
//
//   recording, device file, registration --> chain Image -> Probe -> Tracker -> Reference -> Ras, per frame
//   contours, or seeds and the tracer    --> boundary points, one observation (TumourBoundary, "ius") per sweep
//   case or model file                   --> case_id and model_id of the surgery, and where the tumour lies
//
// Every point's error is sd_mm; it is taken to be independent from point to point, which errors of calibration and
// registration are not: those move all points of a sweep together, and the daemon's ICP sees them as motion.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/ultrasound/import_boundaries.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"

namespace brainshift::client {

struct ImportOptions {
  std::filesystem::path recording;
  std::filesystem::path device;        // PLUS device set; empty: the recording has every transform
  std::filesystem::path contours;      // either this
  std::filesystem::path seeds;         // or this
  std::filesystem::path registration;  // either T_ras_reference
  std::filesystem::path fiducials;     // or the points it is computed from
  std::filesystem::path case_file;     // either this, the model being built again,
  std::filesystem::path model;         // or this
  std::filesystem::path out;
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

// Of the patient registration by fiducials.
struct FiducialReport {
  int count = 0;
  bool matched = false;  // the correspondence was found, not given
  double fre_mm = 0.0, worst_mm = 0.0;
  double tre_mm = 0.0;  // expected at the tumour, rms
};

struct ImportReport {
  int frames = 0, frames_used = 0;
  std::vector<std::string> links;  // the chain
  std::optional<FiducialReport> fiducials;
  std::vector<tracking::Dropped> dropped;
  std::vector<tracking::Dropped> lost_contours;
  std::vector<ImportedSweep> sweeps;
  std::vector<std::string>
      notes;  // what the user should know: defects, where tracing ended, suspicious units
};

// Nothing is left behind on failure. kInvalidArgument, kNotFound, kUnreadable, kEmptySet for input that cannot be used; the
// sentence names option, file, frame or field. A boundary more than 100 mm from the case's tumour is refused.
Result<ImportReport> import_recording(const ImportOptions& options, const Progress& progress = {});

// A line for each fact, for people.
std::vector<std::string> report_lines(const ImportReport& report);

}  // namespace brainshift::client
