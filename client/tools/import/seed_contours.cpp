// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/seed_contours.hpp"

#include <fmt/format.h>

#include <map>

#include "common/io/recording/contour_file.hpp"

namespace brainshift::client {

Result<std::vector<ultrasound::Contour>> contours_of_seeds(const tracking::Recording& recording,
                                                           const std::filesystem::path& path,
                                                           std::vector<std::string>& notes) {
  const auto seeds = io::read_seeds(path);
  if (!seeds) return tl::unexpected(seeds.error());
  std::map<int, ultrasound::TracedContour> best;
  for (const ultrasound::Seed& seed : *seeds) {
    auto sweep = ultrasound::trace_sweep(recording, seed);
    if (!sweep) return fail(sweep.error().code, path.string() + ": " + sweep.error().message);
    const auto& contours = sweep->contours;
    notes.push_back(fmt::format("seed on frame {}: {} lesion traced on frames {} to {}", seed.frame,
                                contours.front().bright ? "bright" : "dark",
                                contours.front().contour.frame, contours.back().contour.frame));
    for (const std::string& stopped : {sweep->stopped_before, sweep->stopped_after}) {
      if (!stopped.empty()) notes.push_back("tracing ended: " + stopped);
    }
    for (const ultrasound::TracedContour& traced : contours) {
      const auto [known, is_new] = best.emplace(traced.contour.frame, traced);
      if (!is_new && traced.confidence > known->second.confidence) known->second = traced;
    }
  }
  std::vector<ultrasound::Contour> contours;
  for (const auto& [frame, traced] : best) contours.push_back(traced.contour);
  return contours;
}

}  // namespace brainshift::client
