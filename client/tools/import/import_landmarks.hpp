// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift import --landmarks`: a surgery file with one observation (LandmarkPairs,
// "landmarks") from homologous landmarks (docs/import.md).
//
// undeformed_i, before surgery -> deformed_i, during it, both mm RAS (io/landmarks/pair_file.hpp).
//
// What lies between the two may be motion of the tissue, a misregistration of the second image, or
// both. The report tells them apart as far as landmarks can: it splits off the rigid motion
//   T = argmin sum_i |T undeformed_i - deformed_i|^2             (registration/fiducials.hpp)
// and says how large it is and what it leaves. The observation keeps the pairs as they are.
//
// Statistics: the error of every landmark has standard deviation sd_mm and is independent of the
// others'. A misregistration is not: it moves all of them together.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/core/types.hpp"

namespace brainshift::client {

struct LandmarkOptions {
  std::filesystem::path landmarks;        // pairs, or the places before surgery
  std::filesystem::path landmarks_moved;  // the places during it, by name; empty: pairs
  // Exactly one.
  std::filesystem::path case_file;  // its model is built again
  std::filesystem::path model;
  std::filesystem::path out;  // must not exist
  double sd_mm = 0.5;         // of a landmark
};

// Of the motion of all landmarks together.
struct RigidPart {
  double rotation_deg = 0.0;
  double translation_mm = 0.0;  // of the landmarks' centroid
  double residual_mm = 0.0;     // rms of what T leaves
};

struct LandmarkReport {
  int pairs = 0;
  double mean_mm = 0.0, rms_mm = 0.0, largest_mm = 0.0;  // of the landmarks' motion
  std::string largest;                                   // the landmark that moved farthest
  std::optional<RigidPart> rigid;
  std::string no_rigid;  // why not, where there is none
  int outside = 0;       // landmarks outside the case's brain, before surgery
  double farthest_outside_mm = 0.0;
  std::string farthest_outside;
  std::vector<std::string> left_out;  // names that only one list has
};

// How far the undeformed place of a landmark may lie outside the brain, mm: cortical landmarks lie
// on a surface that the mesh smooths, and a few millimetres beside it.
inline constexpr double kLargestOutside_mm = 20.0;
// Farther than this tissue does not move in the literature of brain shift; lists in different
// frames do.
inline constexpr double kLargestMotion_mm = 60.0;

// Leaves nothing behind on failure. kInvalidArgument, kNotFound, kUnreadable or kEmptySet for input
// that cannot be used: fewer than 3 pairs, a landmark farther than above from the case's brain or
// from where it was; the sentence names option, file and landmark. An `out` that exists is
// such input. kWriteFailed.
Result<LandmarkReport> import_landmarks(const LandmarkOptions& options,
                                        const Progress& progress = {});

// The report as lines for a terminal.
std::vector<std::string> report_lines(const LandmarkReport& report);

}  // namespace brainshift::client
