// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/inbox.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/tools/import/import_boundaries.hpp"
#include "client/tools/import/import_case.hpp"
#include "common/core/rigid_motion.hpp"
#include "common/igtl/poly_data.hpp"
#include "common/io/geometry/pose_file.hpp"
#include "common/io/landmarks/point_file.hpp"
#include "common/tracking/transform_graph.hpp"

namespace brainshift::client {
namespace {

constexpr const char* kRas = "Ras";
constexpr const char* kSweepSource = "ius";
constexpr double kAhead_s = 1.0;  // of two clocks that are set by the network

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
  if (ok) ok = check_option("--max-data-age-s", options.max_data_age_s, 0.1, 3600.0);
  if (ok) ok = check_option("--max-pose-age-s", options.max_pose_age_s, 0.01, 3600.0);
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

std::chrono::nanoseconds wall_time_at(std::chrono::steady_clock::time_point time) {
  const auto ago = std::chrono::steady_clock::now() - time;
  return std::chrono::system_clock::now().time_since_epoch() - ago;
}

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

Result<Inbox::TimePoint> Inbox::acquired_at(const igtl::Envelope& envelope,
                                            TimePoint arrived) const {
  if (envelope.timestamp == 0 || options_.relative_times) return arrived;
  const auto age = options_.wall_at(arrived) - igtl::to_nanoseconds(envelope.timestamp);
  const double age_s = std::chrono::duration<double>(age).count();
  if (age_s >= -kAhead_s && age_s <= options_.max_data_age_s) {
    return arrived - std::max(age, std::chrono::nanoseconds(0));
  }
  return invalid(
      fmt::format("{}: its time is {:.1f} s {} this computer's clock, must be at most {:g} s: is "
                  "it old, are the "
                  "clocks set alike? (--relative-times for a recording that is played)",
                  igtl::full_device(envelope), std::abs(age_s), age_s > 0.0 ? "behind" : "ahead of",
                  age_s > 0.0 ? options_.max_data_age_s : kAhead_s));
}

void Inbox::keep_transforms(const igtl::Message& message, TimePoint acquired) {
  const auto keep = [&](const std::string& name, const igtl::Matrix34f& matrix, bool valid) {
    const auto frames = tracking::parse_transform_name(name);
    if (!frames) return;
    if (!valid || !check_rigid(igtl::to_matrix(matrix))) {
      newest_.erase(name);
      return;
    }
    newest_[name] = {{*frames, AffineTransform(nearest_rigid(igtl::to_matrix(matrix)))}, acquired};
  };
  const igtl::Envelope& envelope = message.envelope;
  if (const auto* transform = std::get_if<igtl::Transform>(&message.content)) {
    const std::string* status = igtl::find(envelope.metadata, "TransformStatus");
    keep(igtl::full_device(envelope), transform->matrix, status == nullptr || *status == "OK");
  } else if (const auto* tools = std::get_if<igtl::TrackingData>(&message.content)) {
    for (const igtl::TrackedTool& tool : tools->tools) {
      const igtl::ToolState state = igtl::tool_state(envelope, tool.name);
      keep(state.name, tool.matrix, state.valid);
    }
  }
}

Result<AffineTransform> Inbox::T_ras_model(TimePoint at) const {
  if (options_.model_frame == kRas) return AffineTransform::Identity();
  std::vector<tracking::ConstantLink> links = constants_;
  std::vector<TimePoint> acquired(links.size(), at);
  for (const auto& [name, pose] : newest_) {
    links.push_back(pose.link);
    acquired.push_back(pose.acquired);
  }
  std::vector<tracking::FramePair> pairs;
  for (const auto& link : links) pairs.push_back(link.frames);
  const auto steps = tracking::shortest_chain(pairs, options_.model_frame, kRas);
  if (!steps) return tl::unexpected(steps.error());
  AffineTransform T = AffineTransform::Identity();
  for (const tracking::ChainStep& step : *steps) {
    const double away_s = std::chrono::duration<double>(at - acquired[step.link]).count();
    if (std::abs(away_s) > options_.max_pose_age_s) {
      return invalid(fmt::format("{} was seen {:.1f} s {} it, at most {:g} s are allowed",
                                 links[step.link].frames.name(), std::abs(away_s),
                                 away_s > 0.0 ? "before" : "after", options_.max_pose_age_s));
    }
    const AffineTransform& link = links[step.link].T_to_from;
    T = (step.inverted ? link.inverse() : link) * T;
  }
  return T;
}

void Inbox::take_points(const igtl::Envelope& envelope, const Points& points,
                        const std::optional<TriangleSurface>& surface, TimePoint acquired,
                        Taken& taken) {
  const auto meant = [&](const std::string& name) {
    return !name.empty() && igtl::is_named(envelope, name);
  };
  const bool is_tumour = meant(options_.tumour_device);
  if (!is_tumour && !meant(options_.surface_device)) return;
  const std::string device = is_tumour ? options_.tumour_device : options_.surface_device;
  if (points.cols() == 0) {
    taken.notes.push_back(device + ": it has no point");
    return;
  }
  const auto T_ras = T_ras_model(acquired);
  if (!T_ras) {
    taken.notes.push_back(device + ": " + T_ras.error().message);
    return;
  }
  const Points in_ras = (*T_ras) * points;
  if (is_tumour) {
    taken.found.push_back({device, TumourBoundary{in_ras, options_.sd_mm}, acquired,
                           fmt::format("{}: {} boundary points", device, in_ras.cols())});
    return;
  }
  CorticalSurface cortex{{in_ras, {}}, options_.surface_sd_mm};
  if (surface) cortex.surface.triangles = surface->triangles;
  taken.found.push_back({device, std::move(cortex), acquired,
                         fmt::format("{}: {} surface points", device, in_ras.cols())});
}

void Inbox::take_landmarks(const igtl::Envelope& envelope, const igtl::PointList& list,
                           TimePoint acquired, Taken& taken) {
  if (options_.landmarks_after.empty()) return;
  if (igtl::is_named(envelope, options_.landmarks_before)) {
    before_.clear();
    // Where a place was before surgery is a place of the image: RAS.
    for (const auto& point : list.points) before_[point.name] = point.position.cast<double>();
    return;
  }
  if (!igtl::is_named(envelope, options_.landmarks_after)) return;
  const std::string& device = options_.landmarks_after;
  const auto T_ras = T_ras_model(acquired);
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
       acquired, fmt::format("{}: {} landmark pairs", device, deformed.size())});
}

bool Inbox::uses(const igtl::Message& message) const {
  if (std::holds_alternative<igtl::PolyData>(message.content) ||
      std::holds_alternative<igtl::PointList>(message.content)) {
    for (const std::string& name : {options_.tumour_device, options_.surface_device,
                                    options_.landmarks_before, options_.landmarks_after}) {
      if (!name.empty() && igtl::is_named(message.envelope, name)) return true;
    }
    return false;
  }
  if (!std::holds_alternative<igtl::Image>(message.content)) return true;
  return options_.wants_images() && collector_.wants(message.envelope);
}

Taken Inbox::take(const igtl::Message& message, TimePoint arrived) {
  Taken taken = tick(arrived);
  if (!uses(message)) return taken;
  const igtl::Envelope& envelope = message.envelope;
  const auto acquired = acquired_at(envelope, arrived);
  if (!acquired) {
    if (refused_.insert(envelope.device).second) taken.notes.push_back(acquired.error().message);
    return taken;
  }
  refused_.erase(envelope.device);
  if (const auto* data = std::get_if<igtl::PolyData>(&message.content)) {
    std::optional<TriangleSurface> surface;
    if (auto triangles = igtl::to_surface(*data)) surface = std::move(*triangles);
    take_points(envelope, data->points.cast<double>(), surface, *acquired, taken);
  } else if (const auto* list = std::get_if<igtl::PointList>(&message.content)) {
    take_points(envelope, points_of(*list), std::nullopt, *acquired, taken);
    take_landmarks(envelope, *list, *acquired, taken);
  } else {
    keep_transforms(message, *acquired);
    if (!options_.wants_images()) return taken;
    if (std::holds_alternative<igtl::Image>(message.content)) image_age_ = arrived - *acquired;
    const bool waited = collector_.waits_for_a_pause();
    collector_.take(message, arrived);
    if (waited || (!collector_.full() && !collector_.waits_for_a_pause())) return taken;
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
  if (sweep.untimed) return invalid("an image came without a time, which contours need");
  auto contours =
      options_.seeds.empty()
          ? contours_of_file(options_.contours, !options_.open_contours, &sweep.image_ns, notes)
          : contours_of_seeds(sweep.images, options_.seeds, notes, &sweep.image_ns);
  if (!contours) return contours;
  for (ultrasound::Contour& contour : *contours) {
    contour.frame = sweep.moment_of_image[static_cast<std::size_t>(contour.frame)];
  }
  return contours;
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
                           sweep.last_image - image_age_,
                           fmt::format("sweep of {} images: {} contours, {} boundary points",
                                       images, each.contours, each.points.cols())});
  }
  return taken;
}

}  // namespace brainshift::client
