// SPDX-License-Identifier: GPL-3.0-or-later
// What the imports share: the case that data belong to, from its case file or its prepared model;
// the surgery file; what is told of fiducials.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/mesh.hpp"
#include "common/core/progress.hpp"
#include "common/core/types.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/io/recording/surgery_record.hpp"
#include "common/registration/fiducials.hpp"
#include "common/tracking/chain.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/observation.hpp"

namespace brainshift::client {

struct ImportCase {
  BrainModel model;
  std::filesystem::path case_file;  // absolute

  Vec3 tumour_centroid() const;
  // Of a surgery file of this case, made now by `software`.
  io::SurgeryMeta meta(const std::string& scenario, const std::string& software) const;
};

// kInvalidArgument unless exactly one of them is given, in the words of the options --case and
// --model.
Status check_one_case(const std::filesystem::path& case_file, const std::filesystem::path& model);

// One of the two is not empty. The model of a case file is built again. Errors of
// patient::read_patient and io::read_model.
Result<ImportCase> load_import_case(const std::filesystem::path& case_file,
                                    const std::filesystem::path& model,
                                    const Progress& progress = {});

// kInvalidArgument when an option's value lies outside of [least, most], or is no number.
Status check_option(const char* name, double value, double least, double most);

// The fixed transforms of a PLUS device set (.xml); none for an empty path. Errors of
// io::read_plus_config.
Result<std::vector<tracking::ConstantLink>> device_links(const std::filesystem::path& device);

// kInvalidArgument when `out` exists already.
Status check_new(const std::filesystem::path& out);

// Writes a surgery file of observations, as `brainshift replay` plays it.
// `path` must not exist. meta: the keys of surgery_file.hpp.
// kWriteFailed; leaves nothing behind then.
Status write_surgery(const std::filesystem::path& path, const io::SurgeryMeta& meta,
                     const std::vector<Observation>& observations);

// Where the error of a registration is told: exactly one of case file, model and point.
// kInvalidArgument, also for a point that is not finite.
Status check_error_place(const std::filesystem::path& case_file, const std::filesystem::path& model,
                         const std::optional<Vec3>& target);
// Its name: "the tumour", or the point.
std::string error_place(const std::optional<Vec3>& target);

// From the middle of a head, or of the fiducials on it, to a place within.
inline constexpr double kLargestReach_mm = 300.0;
// kInvalidArgument where a target lies farther from the middle `of` something ("the fiducials in
// the image"), or is in metres. name: "--target (1.0, 2.0, 3.0)", "the tumour".
Status check_reach(const Vec3& target, const std::string& name, const Vec3& middle,
                   const std::string& of);

// A meningioma or a pituitary lies beside the brain.
inline constexpr double kBesideBrain_mm = 30.0;
// kInvalidArgument where a target lies farther from every voxel > 0 of a mask, or is in metres. of:
// of whose brain. The sentence says from where to where the mask reaches.
Status check_in_brain(const Vec3& target, const std::string& name, const VoxelImage& mask,
                      const std::string& of);

// What a user should know about a registration by fiducials before relying on it.
struct FiducialReport {
  int count = 0;
  bool matched = false;  // the correspondence was found, not given
  double fre_mm = 0.0, worst_mm = 0.0;
  int worst = 0;          // the fiducial with worst_mm, from 0
  double tre_mm = 0.0;    // expected at the target, rms (registration/fiducials.hpp)
  double thinness = 0.0;  // registration::thinness of the fiducials
};

FiducialReport describe(const registration::FiducialRegistration& fit, bool matched,
                        const Vec3& target);

// Lines for a terminal: the errors, and a note where the fiducials lie nearly on a line, fit poorly
// or are only three. `names`: of the fiducials, or empty. `target`: "the tumour".
std::vector<std::string> fiducial_lines(const FiducialReport& report,
                                        const std::vector<std::string>& names,
                                        const std::string& target);

}  // namespace brainshift::client
