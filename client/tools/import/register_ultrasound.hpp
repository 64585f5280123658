// SPDX-License-Identifier: GPL-3.0-or-later
// `brainshift register --ultrasound`: the patient registration once more, before the dura is
// opened, from tracked ultrasound and the MRI (paper 2.7; docs/register.md).
//
//   x_reference = T_reference_image (u, v, 0)      for every frame: recording and device file
//   T_ras_reference = T_ras_ras T_first            T_first: the first registration, by fiducials
//   T_ras_ras: of the greatest normalised mutual information   (registration/image_registration)
//
// Only the brain counts: skull and scalp, which ultrasound does not show, draw the pose away.
// Frames that repeat the place of the last one used are left out: their speckle is the same, and
// they would count twice. The error comes from the frames themselves (jackknife_error_mm).
//
// Refused: frames near one plane, starts of which fewer than half come to one pose, an expected
// error above kLargestError_mm, a pose at the edge of the search.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/core/types.hpp"
#include "common/registration/image_registration.hpp"
#include "common/tracking/chain.hpp"

namespace brainshift::client {

struct UltrasoundRegisterOptions {
  std::filesystem::path ultrasound;
  std::filesystem::path device;        // PLUS device set with ImageToProbe; may be empty
  std::filesystem::path registration;  // the first T_ras_reference
  std::filesystem::path mri;           // NIfTI, NRRD or .mgz
  std::filesystem::path brain;         // mask; empty: the brain of the model
  // Exactly one: where the expected error is told.
  std::filesystem::path case_file;  // its model is built again; the tumour's centroid
  std::filesystem::path model;
  std::optional<Vec3> target;     // mm RAS
  std::filesystem::path out;      // must not exist
  std::filesystem::path picture;  // .png; empty: `out` with this extension
  std::string image_frame = "Image";
  std::string reference_frame = "Reference";
  std::string orientation;  // for a recording that does not say
  double latency_ms = 0.0;
  double max_age_ms = 200.0;
};

// Blocks of pixels of about this size are one sample.
inline constexpr double kSample_mm = 1.0;
// A frame whose corners lie within this of those of the last frame used, on average, repeats it.
inline constexpr double kRepeats_mm = 0.5;
// Standard deviation of the samples along the direction in which they extend least.
inline constexpr double kLeastThickness_mm = 3.0;
// As in the study: no pose that half of the starts came to was wrong (decision 13).
inline constexpr double kLeastAgreement = 0.5;
// A registration by fiducials errs by 2.5 mm on average, and 1 mm is what this one should leave
// (paper 2.7): above their middle there is little to gain.
inline constexpr double kLargestError_mm = 1.75;
inline constexpr int kParts = 8;  // of the frames, of which there must be as many
// A direction known ten times worse than the best known one is told.
inline constexpr double kShownRatio = 1e-2;

struct UltrasoundRegisterReport {
  int frames = 0;                  // of the recording
  int frames_valid = 0;            // with a chain
  int frames_repeated = 0;         // of those, left out
  std::vector<std::string> links;  // from the image to RAS
  std::vector<tracking::Dropped> dropped;
  Eigen::Index samples = 0;
  registration::ImageRegistration found;
  std::string target;             // "the tumour", or the point
  double moved_mm = 0.0;          // of the target
  double residual_mm = 0.0;       // by how much the target moves without an eighth, rms
  double residual_most_mm = 0.0;  // at most
  double expected_mm = 0.0;       // error at the target, rms
  std::vector<std::string> not_shown;
  std::vector<std::string> notes;  // of the mask
  RigidTransform T_ras_reference = RigidTransform::Identity();
  std::filesystem::path picture;  // as written
};

// Writes T_ras_reference to `out` and the picture, or leaves nothing behind. kInvalidArgument,
// kNotFound, kUnreadable, kEmptySet or kNotConverged for input that cannot be used or shows too
// little; the sentence names option, file and figure. An `out` or a picture that
// exists is such input. kWriteFailed.
Result<UltrasoundRegisterReport> register_ultrasound(const UltrasoundRegisterOptions& options,
                                                     const Progress& progress = {});

// The report as lines for a terminal.
std::vector<std::string> report_lines(const UltrasoundRegisterReport& report);

}  // namespace brainshift::client
