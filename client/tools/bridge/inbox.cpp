// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/inbox.hpp"

#include <fmt/format.h>

#include <utility>

#include "client/tools/import/import_boundaries.hpp"
#include "client/tools/import/import_case.hpp"
#include "common/core/rigid_motion.hpp"
#include "common/igtl/poly_data.hpp"
#include "common/io/geometry/pose_file.hpp"
#include "common/io/landmarks/point_file.hpp"
#include "common/io/recording/contour_file.hpp"
#include "common/tracking/transform_graph.hpp"

namespace brainshift::client {
namespace {

constexpr const char* kRas = "Ras";
constexpr const char* kSweepSource = "ius";

Status check(const InboxOptions& options) {
  if (!options.contours.empty() && !options.seeds.empty()) {
    return invalid("--contours and --seeds: at most one of them");
  }
  if (options.wants_images() && options.registration.empty()) {
    return invalid("--registration is required with --contours or --seeds");
  }
  if (options.landmarks_before.empty() != options.landmarks_after.empty()) {
    return invalid("--landmarks-before and --landmarks-after: both or none");
  }
  Status ok = check_option("--sd-mm", options.sd_mm, 0.01, 20.0);
  if (ok) ok = check_option("--surface-sd-mm", options.surface_sd_mm, 0.01, 20.0);
  if (ok) ok = check_option("--landmark-sd-mm", options.landmark_sd_mm, 0.01, 20.0);
  if (ok) ok = check_option("--latency-ms", options.latency_ms, -1000.0, 1000.0);
  if (ok) ok = check_option("--max-age-ms", options.max_age_ms, 0.0, 60000.0);
  if (ok) ok = check_option("--sweeps", options.sweep_gap_s, 0.1, 3600.0);
  return ok;
}

Points points_of(const igtl::PointList& list) {
  Points points(3, static_cast<Eigen::Index>(list.points.size()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    points.col(i) = list.points[static_cast<std::size_t>(i)].position.cast<double>();
  }
  return points;
}

}  // namespace

Inbox::Inbox(InboxOptions options)
    : options_(std::move(options)),
      collector_(CollectorOptions{.image_device = options_.image_device,
                                  .keep_pixels = !options_.seeds.empty()}) {}

Result<Inbox> Inbox::open(const InboxOptions& options) {
  if (auto ok = check(options); !ok) return tl::unexpected(ok.error());
  Inbox inbox(options);
  auto links = device_links(options.device);
  if (!links) return tl::unexpected(links.error());
  inbox.constants_ = std::move(*links);
  if (!options.registration.empty()) {
    const auto T_ras_reference = io::read_pose(options.registration, "T_ras_reference");
    if (!T_ras_reference) return tl::unexpected(T_ras_reference.error());
    inbox.constants_.push_back(
        {{options.reference_frame, kRas}, AffineTransform(*T_ras_reference)});
  }
  return inbox;
}

igtl::StreamLimits Inbox::from_peers() const {
  igtl::StreamLimits limits;
  limits.wanted = {"GET_STATUS", "GET_CAPABIL"};
  if (options_.wants_models())
    limits.wanted.merge(
        std::set<std::string, std::less<>>{"POLYDATA", "POINT", "TRANSFORM", "TDATA"});
  return limits;
}

igtl::StreamLimits Inbox::from_upstream() const {
  igtl::StreamLimits limits;
  limits.wanted = {"TRANSFORM", "TDATA"};
  if (options_.wants_models())
    limits.wanted.merge(std::set<std::string, std::less<>>{"POLYDATA", "POINT"});
  if (options_.wants_images()) limits.wanted.insert("IMAGE");
  return limits;
}

void Inbox::keep_transforms(const igtl::Message& message) {
  const auto keep = [&](const std::string& name, const igtl::Matrix34f& matrix,
                        const std::string* status) {
    const auto frames = tracking::parse_transform_name(name);
    if (!frames) return;
    const bool valid = status == nullptr || *status == "OK";
    if (!valid || !check_rigid(igtl::to_matrix(matrix))) {
      newest_.erase(name);
      return;
    }
    newest_[name] = {*frames, AffineTransform(nearest_rigid(igtl::to_matrix(matrix)))};
  };
  const igtl::Metadata& metadata = message.envelope.metadata;
  if (const auto* transform = std::get_if<igtl::Transform>(&message.content)) {
    keep(message.envelope.device, transform->matrix, igtl::find(metadata, "TransformStatus"));
  } else if (const auto* tools = std::get_if<igtl::TrackingData>(&message.content)) {
    for (const igtl::TrackedTool& tool : tools->tools) {
      keep(tool.name, tool.matrix, igtl::find(metadata, tool.name + "Status"));
    }
  }
}

Result<AffineTransform> Inbox::T_ras_model() const {
  if (options_.model_frame == kRas) return AffineTransform::Identity();
  std::vector<tracking::ConstantLink> links = constants_;
  for (const auto& [name, link] : newest_) links.push_back(link);
  std::vector<tracking::FramePair> pairs;
  for (const auto& link : links) pairs.push_back(link.frames);
  const auto steps = tracking::shortest_chain(pairs, options_.model_frame, kRas);
  if (!steps) return tl::unexpected(steps.error());
  AffineTransform T = AffineTransform::Identity();
  for (const tracking::ChainStep& step : *steps) {
    const AffineTransform& link = links[step.link].T_to_from;
    T = (step.inverted ? link.inverse() : link) * T;
  }
  return T;
}

void Inbox::take_points(const std::string& device, const Points& points,
                        const std::optional<TriangleSurface>& surface, TimePoint arrived,
                        Taken& taken) {
  const bool is_tumour = device == options_.tumour_device;
  if (!is_tumour && device != options_.surface_device) return;
  if (points.cols() == 0) {
    taken.notes.push_back(device + ": it has no point");
    return;
  }
  const auto T_ras = T_ras_model();
  if (!T_ras) {
    taken.notes.push_back(device + ": " + T_ras.error().message);
    return;
  }
  const Points in_ras = (*T_ras) * points;
  if (is_tumour) {
    taken.found.push_back({device, TumourBoundary{in_ras, options_.sd_mm}, arrived,
                           fmt::format("{}: {} boundary points", device, in_ras.cols())});
    return;
  }
  CorticalSurface cortex{{in_ras, {}}, options_.surface_sd_mm};
  if (surface) cortex.surface.triangles = surface->triangles;
  taken.found.push_back({device, std::move(cortex), arrived,
                         fmt::format("{}: {} surface points", device, in_ras.cols())});
}

void Inbox::take_landmarks(const std::string& device, const igtl::PointList& list,
                           TimePoint arrived, Taken& taken) {
  if (options_.landmarks_after.empty()) return;
  if (device == options_.landmarks_before) {
    before_.clear();
    // Where a place was before surgery is a place of the image: RAS.
    for (const auto& point : list.points) before_[point.name] = point.position.cast<double>();
    return;
  }
  if (device != options_.landmarks_after) return;
  const auto T_ras = T_ras_model();
  if (!T_ras) {
    taken.notes.push_back(device + ": " + T_ras.error().message);
    return;
  }
  std::vector<Vec3> undeformed, deformed;
  for (const auto& point : list.points) {
    const auto before = before_.find(point.name);
    if (before == before_.end()) continue;
    undeformed.push_back(before->second);
    deformed.emplace_back(*T_ras * Vec3(point.position.cast<double>()));
  }
  if (deformed.empty()) {
    taken.notes.push_back(device + ": no point has the name of one of " +
                          options_.landmarks_before);
    return;
  }
  taken.found.push_back(
      {device, LandmarkPairs{columns_of(undeformed), columns_of(deformed), options_.landmark_sd_mm},
       arrived, fmt::format("{}: {} landmark pairs", device, deformed.size())});
}

Taken Inbox::take(const igtl::Message& message, TimePoint arrived) {
  Taken taken = tick(arrived);
  const std::string& device = message.envelope.device;
  if (const auto* data = std::get_if<igtl::PolyData>(&message.content)) {
    std::optional<TriangleSurface> surface;
    if (auto triangles = igtl::to_surface(*data)) surface = std::move(*triangles);
    take_points(device, data->points.cast<double>(), surface, arrived, taken);
  } else if (const auto* list = std::get_if<igtl::PointList>(&message.content)) {
    take_points(device, points_of(*list), std::nullopt, arrived, taken);
    take_landmarks(device, *list, arrived, taken);
  } else {
    keep_transforms(message);
    if (!options_.wants_images()) return taken;
    collector_.take(message, arrived);
    if (!collector_.full() || collector_.waits_for_a_pause()) return taken;
    Taken sweep = end_sweep(false);
    std::move(sweep.found.begin(), sweep.found.end(), std::back_inserter(taken.found));
    std::move(sweep.notes.begin(), sweep.notes.end(), std::back_inserter(taken.notes));
  }
  return taken;
}

Taken Inbox::tick(TimePoint now) {
  const auto last = collector_.last_image();
  if (!last) return {};
  const double since_s = std::chrono::duration<double>(now - *last).count();
  if (since_s < options_.sweep_gap_s) return {};
  return end_sweep(true);
}

Result<std::vector<ultrasound::Contour>> Inbox::contours_of(const CollectedSweep& sweep,
                                                            std::vector<std::string>& notes) const {
  std::vector<ultrasound::Contour> contours;
  if (options_.seeds.empty()) {
    auto read = io::read_contours(options_.contours, !options_.open_contours);
    if (!read) return tl::unexpected(read.error());
    contours = std::move(*read);
  } else {
    auto traced = contours_of_seeds(sweep.images, options_.seeds, notes);
    if (!traced) return tl::unexpected(traced.error());
    contours = std::move(*traced);
  }
  const int images = sweep.images.num_frames();
  std::vector<ultrasound::Contour> used;
  std::size_t left_out = 0;
  for (ultrasound::Contour& contour : contours) {
    if (contour.frame >= images) continue;
    contour.frame = sweep.moment_of_image[static_cast<std::size_t>(contour.frame)];
    if (contour.frame < 0) {
      ++left_out;
      continue;
    }
    used.push_back(std::move(contour));
  }
  if (left_out > 0) {
    notes.push_back(fmt::format("{} contours are of images that were left out", left_out));
  }
  if (const std::size_t beyond = contours.size() - used.size() - left_out; beyond > 0) {
    notes.push_back(fmt::format("{} contours are of images that the sweep of {} does not have",
                                beyond, images));
  }
  return used;
}

void Inbox::lose(const igtl::Envelope& image) {
  if (!options_.wants_images()) return;
  if (options_.image_device.empty() || image.device == options_.image_device) collector_.lose(1);
}

Taken Inbox::end_sweep(bool paused) {
  Taken taken;
  const CollectedSweep sweep = collector_.finish(paused);
  taken.notes = sweep.notes;
  const int images = sweep.images.num_frames();
  if (images == 0) return taken;
  const auto contours = contours_of(sweep, taken.notes);
  if (!contours) {
    taken.notes.push_back(fmt::format("sweep of {} images: {}", images, contours.error().message));
    return taken;
  }
  BoundaryOptions boundary;
  boundary.image_frame = options_.image_frame;
  boundary.chain.latency_s = 1e-3 * options_.latency_ms;
  boundary.chain.time.max_age_s = 1e-3 * options_.max_age_ms;
  const auto boundaries = boundaries_in_ras(sweep.moments, constants_, *contours, boundary);
  if (!boundaries) {
    taken.notes.push_back(
        fmt::format("sweep of {} images: {}", images, boundaries.error().message));
    return taken;
  }
  for (const tracking::Dropped& lost : boundaries->lost_contours) {
    taken.notes.push_back(fmt::format("contours left out: {} because {}", lost.count, lost.reason));
  }
  for (const SweepBoundary& each : boundaries->sweeps) {
    taken.found.push_back({kSweepSource, TumourBoundary{each.points, options_.sd_mm},
                           sweep.last_image,
                           fmt::format("sweep of {} images: {} contours, {} boundary points",
                                       images, each.contours, each.points.cols())});
  }
  return taken;
}

}  // namespace brainshift::client
