// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/import_boundaries.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <optional>

#include "common/io/recording/contour_file.hpp"

namespace brainshift::client {
namespace {

// Ultrasound pixels are 0.02 to 0.5 mm wide.
constexpr double kMinPixel_mm = 0.005;
constexpr double kMaxPixel_mm = 2.0;
// A lesion's boundary; a head is 250 mm long.
constexpr double kMinExtent_mm = 1.0;
constexpr double kMaxExtent_mm = 300.0;

Status check_pixel(const AffineTransform& T, int frame) {
  for (int axis = 0; axis < 2; ++axis) {
    const double width_mm = T.linear().col(axis).norm();
    if (width_mm >= kMinPixel_mm && width_mm <= kMaxPixel_mm) continue;
    return invalid(
        fmt::format("a pixel of frame {} is {:.3g} mm {}: must be {} to {} mm; is a transform "
                    "in metres or the calibration missing?",
                    frame, width_mm, axis == 0 ? "wide" : "high", kMinPixel_mm, kMaxPixel_mm));
  }
  return {};
}

Status check_extent(const SweepBoundary& sweep) {
  const Vec3 size = sweep.points.rowwise().maxCoeff() - sweep.points.rowwise().minCoeff();
  if (size.norm() >= kMinExtent_mm && size.norm() <= kMaxExtent_mm) return {};
  return invalid(
      fmt::format("the boundary of frames {} to {} spans {:.3g} mm: must be {} to {} mm; are "
                  "tracked transforms or contours in another unit?",
                  sweep.first_frame, sweep.last_frame, size.norm(), kMinExtent_mm, kMaxExtent_mm));
}

std::string summary(const std::vector<tracking::Dropped>& dropped) {
  std::string text;
  for (const tracking::Dropped& entry : dropped) {
    text += fmt::format("{}{} ({} frames, first {})", text.empty() ? "" : "; ", entry.reason,
                        entry.count, entry.first_frame);
  }
  return text;
}

// Contours must lie on the image, which ends half a pixel beyond the outermost pixels' centres.
Status check_contours(const tracking::Recording& recording,
                      const std::vector<ultrasound::Contour>& contours) {
  for (const ultrasound::Contour& contour : contours) {
    if (contour.frame < 0 || contour.frame >= recording.num_frames()) {
      return invalid(fmt::format("contour on frame {}: the recording has frames 0 to {}",
                                 contour.frame, recording.num_frames() - 1));
    }
    for (Eigen::Index i = 0; i < contour.points_px.cols(); ++i) {
      const double u = contour.points_px(0, i), v = contour.points_px(1, i);
      if (u >= -0.5 && u <= recording.width - 0.5 && v >= -0.5 && v <= recording.height - 0.5) {
        continue;
      }
      return invalid(
          fmt::format("contour on frame {}: {} {} px lies outside the image of {} x {} pixels",
                      contour.frame, u, v, recording.width, recording.height));
    }
  }
  return {};
}

// The live image at that time; nullopt: none came.
std::optional<int> image_at(const ImageTimes& images, std::int64_t ns) {
  const auto after = std::lower_bound(images.begin(), images.end(), ns);
  std::optional<std::size_t> best;
  std::int64_t nearest_ns = kSameImage_ns + 1, second_ns = std::numeric_limits<std::int64_t>::max();
  for (const auto& candidate : {after, after == images.begin() ? images.end() : after - 1}) {
    if (candidate == images.end()) continue;
    const std::int64_t away_ns = std::abs(*candidate - ns);
    if (away_ns < nearest_ns) {
      second_ns = best ? nearest_ns : second_ns;
      nearest_ns = away_ns;
      best = static_cast<std::size_t>(candidate - images.begin());
    } else {
      second_ns = std::min(second_ns, away_ns);
    }
  }
  if (!best || second_ns == nearest_ns) return std::nullopt;
  return static_cast<int>(*best);
}

// Gives every row (Contour, Seed) the number of its image, and leaves out those without.
template <typename Row>
Status place(std::vector<Row>& rows, const std::filesystem::path& path, const ImageTimes* images,
             std::vector<std::string>& notes) {
  const auto is_timed = [](const Row& row) { return !std::isnan(row.time_s); };
  if (images == nullptr) {
    if (std::none_of(rows.begin(), rows.end(), is_timed)) return {};
    return invalid(path.string() +
                   ": time_s names live images (brainshift bridge): frames of a recording count "
                   "from 0");
  }
  if (!std::all_of(rows.begin(), rows.end(), is_timed)) {
    return invalid(path.string() +
                   ": frames cannot be counted in a live stream: name the images by time "
                   "(time_s,u_px,v_px)");
  }
  const std::size_t given = rows.size();
  std::size_t missing = 0;  // between the sweep's images
  std::erase_if(rows, [&](Row& row) {
    const auto ns = static_cast<std::int64_t>(std::llround(1e9 * row.time_s));
    const auto image = image_at(*images, ns);
    if (image) row.frame = *image;
    if (!image && ns > images->front() && ns < images->back()) ++missing;
    return !image;
  });
  if (missing > 0) {
    notes.push_back(fmt::format("{}: {} of {} left out: no image came at their time", path.string(),
                                missing, given));
  }
  if (!rows.empty()) return {};
  return fail(ErrorCode::kEmptySet,
              fmt::format("{}: none of {} is of an image of this sweep (times {:.3f} to {:.3f} s)",
                          path.string(), given, 1e-9 * static_cast<double>(images->front()),
                          1e-9 * static_cast<double>(images->back())));
}

void append_columns(Points& points, const Points& more) {
  const Eigen::Index before = points.cols();
  points.conservativeResize(3, before + more.cols());
  points.rightCols(more.cols()) = more;
}

}  // namespace

Result<Boundaries> boundaries_in_ras(const tracking::Recording& recording,
                                     const std::vector<tracking::ConstantLink>& constants,
                                     std::vector<ultrasound::Contour> contours,
                                     const BoundaryOptions& options) {
  if (!(options.sweep_gap_s >= 0.0)) {
    return invalid(fmt::format("gap between sweeps = {} s: must be >= 0", options.sweep_gap_s));
  }
  if (Status ok = check_contours(recording, contours); !ok) return tl::unexpected(ok.error());
  auto chain =
      tracking::evaluate_chain(recording, constants, options.image_frame, "Ras", options.chain);
  if (!chain) return tl::unexpected(chain.error());
  std::stable_sort(contours.begin(), contours.end(),
                   [](const auto& a, const auto& b) { return a.frame < b.frame; });
  Boundaries result;
  result.chain = std::move(*chain);
  double last_time_s = 0.0;
  for (const ultrasound::Contour& contour : contours) {
    const auto frame = static_cast<std::size_t>(contour.frame);
    const auto& T_ras_image = result.chain.T_target_source[frame];
    if (!T_ras_image) {
      count_dropped(result.lost_contours, result.chain.why_not[frame], contour.frame);
      continue;
    }
    if (Status ok = check_pixel(*T_ras_image, contour.frame); !ok)
      return tl::unexpected(ok.error());
    const auto points = ultrasound::boundary_points(contour, *T_ras_image, options.spacing_mm);
    if (!points) return tl::unexpected(points.error());
    const double time_s = recording.time_s[frame] - recording.time_s.front();
    const bool gap = options.sweep_gap_s > 0.0 && time_s - last_time_s > options.sweep_gap_s;
    if (result.sweeps.empty() || gap) {
      result.sweeps.push_back({contour.frame, contour.frame, 0, 0.0, Points(3, 0)});
    }
    SweepBoundary& sweep = result.sweeps.back();
    sweep.last_frame = contour.frame;
    sweep.time_s = last_time_s = time_s;
    ++sweep.contours;
    append_columns(sweep.points, *points);
  }
  if (result.sweeps.empty()) {
    return fail(ErrorCode::kEmptySet, "no contour lies on a frame with a valid chain from " +
                                          options.image_frame +
                                          " to Ras: " + summary(result.lost_contours));
  }
  for (const SweepBoundary& sweep : result.sweeps) {
    if (Status ok = check_extent(sweep); !ok) return tl::unexpected(ok.error());
  }
  return result;
}

Result<std::vector<ultrasound::Contour>> contours_of_file(const std::filesystem::path& path,
                                                          bool closed, const ImageTimes* images,
                                                          std::vector<std::string>& notes) {
  auto contours = io::read_contours(path, closed);
  if (!contours) return contours;
  if (auto ok = place(*contours, path, images, notes); !ok) return tl::unexpected(ok.error());
  return contours;
}

Result<std::vector<ultrasound::Contour>> contours_of_seeds(const tracking::Recording& recording,
                                                           const std::filesystem::path& path,
                                                           std::vector<std::string>& notes,
                                                           const ImageTimes* images) {
  auto seeds = io::read_seeds(path);
  if (!seeds) return tl::unexpected(seeds.error());
  if (auto ok = place(*seeds, path, images, notes); !ok) return tl::unexpected(ok.error());
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
