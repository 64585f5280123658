// SPDX-License-Identifier: GPL-3.0-or-later
// Contours traced from the seeds of a file, for recorded and for live images.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/tracking/recording.hpp"
#include "common/ultrasound/boundary.hpp"

namespace brainshift::client {

// By frame, ascending; where two seeds reach the same image, the more confident contour. notes: for
// each seed what was traced, and where tracing ended. Errors of io::read_seeds and of
// ultrasound::trace_sweep, which name the file.
Result<std::vector<ultrasound::Contour>> contours_of_seeds(const tracking::Recording& recording,
                                                           const std::filesystem::path& path,
                                                           std::vector<std::string>& notes);

}  // namespace brainshift::client
