// SPDX-License-Identifier: GPL-3.0-or-later
// From contours on the images of a recording to tumour boundaries in patient RAS, one for each
// sweep; and contours from seeds.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/tracking/chain.hpp"
#include "common/tracking/recording.hpp"
#include "common/ultrasound/boundary.hpp"

namespace brainshift::client {

struct BoundaryOptions {
  std::string image_frame = "Image";
  tracking::ChainOptions chain;
  double spacing_mm = ultrasound::kBoundarySpacing_mm;
  // A new sweep begins after this long without a traced contour; 0: the recording is one sweep.
  double sweep_gap_s = 0.0;
};

struct SweepBoundary {
  int first_frame = 0, last_frame = 0;
  int contours = 0;
  double time_s = 0.0;  // of the last frame, since the recording's first
  Points points;        // 3 x m, mm RAS
};

struct Boundaries {
  std::vector<SweepBoundary> sweeps;
  tracking::Chain chain;                         // of every frame
  std::vector<tracking::Dropped> lost_contours;  // contours on frames without a chain
};

// kInvalidArgument: no chain leads from the image frame to RAS; a contour on a frame that does not
// exist or outside its image; options out of range; a pixel that is not 0.005 to 2 mm wide (metres
// taken for mm); a boundary that does not span 1 to 300 mm.
// kEmptySet: no contour lies on a frame with a valid chain; the sentence gives the reasons.
Result<Boundaries> boundaries_in_ras(const tracking::Recording& recording,
                                     const std::vector<tracking::ConstantLink>& constants,
                                     std::vector<ultrasound::Contour> contours,
                                     const BoundaryOptions& options = {});

// Times of live images, ns since 1970 UTC, ascending. Nobody else counts the images that came: rows
// of contours and seeds name them by time (time_s of contour_file.hpp). null: a recording, whose
// frames count from 0.
using ImageTimes = std::vector<std::int64_t>;

// Two clocks are never compared: both times are the image's own, one of them rounded at most.
inline constexpr std::int64_t kSameImage_ns = 1'000'000;

// Contours of a file, with `frame` counting the recording's or the live images. A row belongs to
// the image at its time, within kSameImage_ns and nearer than half way to the next image. Rows
// without such an image are left out with a note. kInvalidArgument: rows that count live images,
// or name recorded ones by time; kEmptySet: no row has an image; errors of io::read_contours.
Result<std::vector<ultrasound::Contour>> contours_of_file(const std::filesystem::path& path,
                                                          bool closed, const ImageTimes* images,
                                                          std::vector<std::string>& notes);

// Contours traced from the seeds of a file, for recorded and for live images (contours_of_file).
// By frame, ascending; where two seeds reach the same image, the more confident contour. notes: for
// each seed what was traced, and where tracing ended. Errors of io::read_seeds and of
// ultrasound::trace_sweep, which name the file.
Result<std::vector<ultrasound::Contour>> contours_of_seeds(const tracking::Recording& recording,
                                                           const std::filesystem::path& path,
                                                           std::vector<std::string>& notes,
                                                           const ImageTimes* images = nullptr);

}  // namespace brainshift::client
