// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/tracking/chain.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <tuple>

#include "common/tracking/transform_graph.hpp"

namespace brainshift::tracking {
namespace {

std::string reason_of(const FramePair& link, PoseOutcome outcome) {
  switch (outcome) {
    case PoseOutcome::kInvalid: return link.name() + " is invalid";
    case PoseOutcome::kMissing: return link.name() + " is missing";
    case PoseOutcome::kWithoutStatus: return link.name() + " has no status";
    case PoseOutcome::kStale: return link.name() + " is too old";
    case PoseOutcome::kOutsideTime: return link.name() + " was not tracked at that time";
    case PoseOutcome::kOk: break;
  }
  return link.name();
}

Status check_options(const ChainOptions& options) {
  const auto check = [](const char* name, double value, double least, double most) -> Status {
    if (value >= least && value <= most) return {};
    return invalid(fmt::format("{} = {} s: must be {} to {}", name, value, least, most));
  };
  if (Status ok = check("latency", options.latency_s, -1.0, 1.0); !ok) return ok;
  if (Status ok = check("max age", options.time.max_age_s, 0.0, 60.0); !ok) return ok;
  return check("max extrapolation", options.time.max_extrapolation_s, 0.0, 1.0);
}

// Poses can be looked up at another time only if the frames have times of their own. An image that
// was recorded twice has one time and one pose.
Status check_clock(const Recording& recording, const ChainOptions& options) {
  if (options.latency_s == 0.0) return {};
  for (std::size_t i = 1; i < recording.time_s.size(); ++i) {
    if (recording.time_s[i] > recording.time_s[i - 1]) continue;
    const auto moved = [i](const LinkSeries& series) {
      const auto& [before, now] = std::tie(series.samples[i - 1], series.samples[i]);
      return before.status == LinkStatus::kOk && now.status == LinkStatus::kOk &&
             before.T_to_from.matrix() != now.T_to_from.matrix();
    };
    if (std::none_of(recording.links.begin(), recording.links.end(), moved)) continue;
    return invalid(fmt::format(
        "frames {} and {} have the time {} s and different poses: a latency of {} s cannot be "
        "taken off; give 0, by which every frame has its own pose",
        i - 1, i, recording.time_s[i], options.latency_s));
  }
  return {};
}

struct FramePose {
  std::optional<AffineTransform> T;
  std::string why_not;
};

FramePose pose_of_frame(const Recording& recording, const std::vector<ConstantLink>& constants,
                        const std::vector<FramePair>& links, const std::vector<ChainStep>& steps,
                        int frame, const ChainOptions& options) {
  const auto at = static_cast<std::size_t>(frame);
  if (!recording.image_ok[at]) return {std::nullopt, "the image is invalid"};
  const double t_s = recording.time_s[at] - options.latency_s;
  AffineTransform T = AffineTransform::Identity();
  for (const ChainStep& step : steps) {
    PoseAtTime pose;
    if (step.link < constants.size()) {
      pose = {PoseOutcome::kOk, constants[step.link].T_to_from};
    } else {
      const LinkSeries& series = recording.links[step.link - constants.size()];
      pose = options.latency_s == 0.0 && series.samples[at].status != LinkStatus::kMissing
                 ? own_pose(series.samples[at])
                 : pose_at(recording.time_s, series.samples, t_s, options.time);
    }
    if (pose.outcome != PoseOutcome::kOk) {
      return {std::nullopt, reason_of(links[step.link], pose.outcome)};
    }
    T = (step.inverted ? pose.T_to_from.inverse() : pose.T_to_from) * T;
  }
  return {T, {}};
}

}  // namespace

void count_dropped(std::vector<Dropped>& dropped, const std::string& reason, int frame) {
  const auto known = std::find_if(dropped.begin(), dropped.end(),
                                  [&](const Dropped& entry) { return entry.reason == reason; });
  if (known == dropped.end()) {
    dropped.push_back({reason, 1, frame});
  } else {
    ++known->count;
  }
}

Result<Chain> evaluate_chain(const Recording& recording, const std::vector<ConstantLink>& constants,
                             const std::string& source, const std::string& target,
                             const ChainOptions& options) {
  if (Status ok = check_options(options); !ok) return tl::unexpected(ok.error());
  std::vector<FramePair> links;
  for (const ConstantLink& link : constants) links.push_back(link.frames);
  for (const LinkSeries& series : recording.links) links.push_back(series.frames);
  const auto steps = shortest_chain(links, source, target);
  if (!steps) return tl::unexpected(steps.error());
  if (Status ok = check_clock(recording, options); !ok) return tl::unexpected(ok.error());

  Chain chain;
  for (const ChainStep& step : *steps) chain.links.push_back(links[step.link].name());
  for (int i = 0; i < recording.num_frames(); ++i) {
    FramePose pose = pose_of_frame(recording, constants, links, *steps, i, options);
    if (pose.T) {
      ++chain.used;
    } else {
      count_dropped(chain.dropped, pose.why_not, i);
    }
    chain.T_target_source.push_back(pose.T);
    chain.why_not.push_back(std::move(pose.why_not));
  }
  return chain;
}

}  // namespace brainshift::tracking
