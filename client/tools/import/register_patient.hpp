// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift register`: the patient registration T_ras_reference from fiducials
// (docs/register.md).
//
//   recording of a stylus held still on each fiducial, or a list of points --> p_i, reference frame
//   where the fiducials lie in the image                                   --> q_i, RAS
//   T_ras_reference = argmin sum_i |T p_i - q_i|^2                (registration/fiducials.hpp)
//
// The errors reported assume independent localisation errors of the fiducials, alike in all
// directions. The registration error (FRE) says nothing about the target; the expected error at the
// target (TRE) does, as far as the assumption holds.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/tools/import/held_points.hpp"
#include "client/tools/import/import_case.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/tracking/chain.hpp"

namespace brainshift::client {

// How touched fiducials and those of the image are paired.
enum class Pairing {
  kAuto,  // by name where both lists name all of theirs, else in order
  kName,
  kOrder,
  kShape,  // by the distances between them (up to 10 touched, 16 in the image)
};

struct RegisterOptions {
  // Exactly one: poses of a stylus, or points touched (reference frame, mm). A list of pairs as
  // io::read_fiducials reads it needs no `ras`.
  std::filesystem::path recording;
  std::filesystem::path fiducials;
  std::filesystem::path device;  // PLUS device set with StylusTipToStylus; may be empty
  std::filesystem::path ras;     // .mrk.json, .fcsv or .csv: the fiducials in the image
  // Exactly one: where the expected error is told.
  std::filesystem::path case_file;  // its model is built again; the tumour's centroid
  std::filesystem::path model;
  std::optional<Vec3> target;  // mm RAS
  std::filesystem::path out;   // must not exist
  std::string tip_frame = "StylusTip";
  std::string reference_frame = "Reference";
  Pairing pairing = Pairing::kAuto;
  HoldOptions hold;
  std::vector<int> holds;  // which ones are fiducials, counted from 1; empty: all
};

struct RegisterReport {
  int poses = 0, poses_used = 0;  // of the recording
  std::vector<std::string> links;
  std::vector<tracking::Dropped> dropped;
  std::vector<HeldPoint> held;        // all of them
  std::vector<int> chosen;            // of `held`, from 0
  std::vector<std::string> names;     // of the fiducials, where known
  std::vector<double> residuals_mm;   // of each fiducial
  std::vector<std::string> left_out;  // names that only one list has
  FiducialReport fiducials;
  std::string target;  // "the tumour", or the point
  RigidTransform T_ras_reference = RigidTransform::Identity();
};

// Writes T_ras_reference to `out`, or leaves nothing behind. kInvalidArgument, kNotFound,
// kUnreadable, kEmptySet or kNotConverged for input that cannot be used; the sentence names option,
// file and figure. An `out` that exists is such input. kWriteFailed.
Result<RegisterReport> register_patient(const RegisterOptions& options,
                                        const Progress& progress = {});

// The report as lines for a terminal.
std::vector<std::string> report_lines(const RegisterReport& report);

}  // namespace brainshift::client
