// SPDX-License-Identifier: GPL-3.0-or-later
// What a user should know about a registration by fiducials before relying on it.
#pragma once

#include <string>
#include <vector>

#include "common/core/types.hpp"
#include "common/registration/fiducials.hpp"

namespace brainshift::client {

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

// Lines for a terminal: the errors, and a note where the fiducials lie nearly on a line or are only
// three. `names`: of the fiducials, or empty. `target`: "the tumour".
std::vector<std::string> fiducial_lines(const FiducialReport& report,
                                        const std::vector<std::string>& names,
                                        const std::string& target);

}  // namespace brainshift::client
