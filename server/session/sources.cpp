// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/session/sources.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "common/core/text.hpp"

namespace brainshift::server {
namespace {

constexpr std::size_t kMaxSourceLength = 64;

double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

Status check_stamp(const char* name, std::int64_t stamp_ns) {
  if (stamp_ns >= -SourceClock::kMaxStamp_ns && stamp_ns <= SourceClock::kMaxStamp_ns) return {};
  return invalid(
      fmt::format("observation.{} = {}: no monotonic clock shows this, must be within {}", name,
                  stamp_ns, SourceClock::kMaxStamp_ns));
}

tl::unexpected<Error> refuse(const Observation& observation, const std::string& why) {
  return invalid(fmt::format("observation.acquired_ns = {} of {}: {}", observation.acquired_ns,
                             in_quotes(observation.source), why));
}

Status check_count(const char* field, const char* unit, Eigen::Index count, int fewest, int most) {
  if (count >= fewest && count <= most) return {};
  return invalid(fmt::format("observation.{} has {} {}, must be at {} {}", field, count, unit,
                             count < fewest ? "least" : "most", count < fewest ? fewest : most));
}

Status check_size(const TumourBoundary& body) {
  return check_count("tumour_boundary", "points", body.points.cols(), kMinObservedPoints,
                     kMaxObservedPoints);
}
Status check_size(const CorticalSurface& body) {
  const auto& [vertices, triangles] = body.surface;
  if (auto ok = check_count("cortical_surface", "points", vertices.cols(), kMinObservedPoints,
                            kMaxObservedPoints);
      !ok) {
    return ok;
  }
  return check_count("cortical_surface", "triangles", triangles.cols(), 0, kMaxObservedTriangles);
}
Status check_size(const LandmarkPairs& body) {
  return check_count("landmark_pairs", "pairs", body.undeformed.cols(), kMinObservedPoints,
                     kMaxLandmarkPairs);
}
Status check_size(const PatientPose&) {
  return invalid(
      "observation.patient_pose: a change of pose is not assimilated in this version; start a "
      "session on a model prepared for the new pose");
}

}  // namespace

Status check_observation(const Observation& observation, std::string_view case_id,
                         const SessionKey& running) {
  if (observation.case_id != case_id) {
    return invalid(fmt::format("observation.case_id = {}: the running session is for {}",
                               in_quotes(observation.case_id), in_quotes(case_id)));
  }
  if (const SessionKey& given = observation.session; given != running) {
    if (given == SessionKey{}) {
      return invalid("observation.session is absent: must name the session that it is for");
    }
    if (given.boot_id != running.boot_id) {
      return invalid(
          fmt::format("observation.session.boot_id = {:x}: the daemon has been restarted, or this "
                      "is another one ({:x}); subscribe again, and observe for the session that it "
                      "names",
                      given.boot_id, running.boot_id));
    }
    if (given.model_id != running.model_id) {
      return invalid(fmt::format("observation.session.model_id = {}: the daemon serves model {}",
                                 in_quotes(given.model_id), in_quotes(running.model_id)));
    }
    return invalid(
        fmt::format("observation.session.session_id = {}: the running session is {}; "
                    "subscribe again, and observe for the session that is named then",
                    given.session_id, running.session_id));
  }
  if (observation.frame != "ras") {
    return invalid(
        fmt::format("observation.frame = {}: must be \"ras\"", in_quotes(observation.frame)));
  }
  if (observation.source.empty() || observation.source.size() > kMaxSourceLength) {
    return invalid(fmt::format("observation.source = {}: must have 1 to {} characters",
                               in_quotes(observation.source), kMaxSourceLength));
  }
  if (one_line(observation.source) != observation.source) {
    return invalid(fmt::format("observation.source = {}: must have no control characters",
                               in_quotes(observation.source)));
  }
  return std::visit([](const auto& body) { return check_size(body); }, observation.body);
}

Result<std::int64_t> recorded_time(const Observation& observation) {
  if (auto status = check_stamp("acquired_ns", observation.acquired_ns); !status) {
    return tl::unexpected(status.error());
  }
  return observation.acquired_ns;
}

Result<std::int64_t> SourceClock::to_daemon(const Observation& observation,
                                            std::int64_t arrived_ns) {
  const std::int64_t acquired_ns = observation.acquired_ns;
  if (auto ok = check_stamp("acquired_ns", acquired_ns); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_stamp("sent_ns", observation.sent_ns); !ok) return tl::unexpected(ok.error());
  const std::int64_t sent_ns = observation.sent_ns != 0 ? observation.sent_ns : acquired_ns;
  if (acquired_ns > sent_ns) {
    return refuse(observation, fmt::format("acquired {:.3g} s after it was sent",
                                           seconds(acquired_ns - sent_ns)));
  }
  if (offset_ns_ && acquired_ns < last_acquired_ns_) {
    return refuse(observation, fmt::format("acquired {:.3g} s before the one before it",
                                           seconds(last_acquired_ns_ - acquired_ns)));
  }
  const std::int64_t offset_ns = arrived_ns - sent_ns;
  if (offset_ns_ && *offset_ns_ - offset_ns > kMaxJump_ns) {
    const bool again =
        refused_offset_ns_ && std::abs(*refused_offset_ns_ - offset_ns) <= kMaxJump_ns;
    const std::int64_t jump_ns = *offset_ns_ - offset_ns;
    refused_offset_ns_ = offset_ns;
    if (!again) {
      return refuse(observation, fmt::format("the source's clock has jumped ahead by {:.0f} s",
                                             seconds(jump_ns)));
    }
  }
  const std::int64_t known_ns = offset_ns_ ? std::min(*offset_ns_, offset_ns) : offset_ns;
  const double age_s = seconds(arrived_ns - (acquired_ns + known_ns));
  if (age_s > max_age_s_) {
    return refuse(observation, fmt::format("{:.0f} s old when it arrived, sensing.max_age_s = {:g}",
                                           age_s, max_age_s_));
  }
  offset_ns_ = known_ns;
  refused_offset_ns_.reset();
  last_acquired_ns_ = acquired_ns;
  return acquired_ns + known_ns;
}

Status Sources::has_room(const Observation& observation, std::int64_t arrived_ns,
                         const std::string& client) const {
  const auto own = std::count_if(sources_.begin(), sources_.end(), [&](const auto& entry) {
    return !client.empty() && entry.second.client == client;
  });
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::kUnavailable,
                fmt::format("observation.source = {}: {}", in_quotes(observation.source), why));
  };
  if (own >= kMaxSourcesOfOne) {
    return refuse(fmt::format("{} other sources have observed from this connection already", own));
  }
  if (sources_.size() < kMaxSources ||
      seconds(arrived_ns - longest_silent()->second.arrived_ns) > max_age_s_) {
    return {};
  }
  return refuse(
      fmt::format("{} other sources have observed in the last {:g} s", kMaxSources, max_age_s_));
}

Sources::Map::const_iterator Sources::longest_silent() const {
  return std::min_element(sources_.begin(), sources_.end(), [](const auto& a, const auto& b) {
    return a.second.arrived_ns < b.second.arrived_ns;
  });
}

Result<Admission> Sources::admit(const Observation& observation, std::int64_t arrived_ns,
                                 bool replaces_pending, const std::string& client) {
  const auto known = sources_.find(observation.source);
  const bool is_new = known == sources_.end();
  if (is_new) {
    if (auto room = has_room(observation, arrived_ns, client); !room) {
      return tl::unexpected(room.error());
    }
  }
  Source source = is_new ? Source{SourceClock(max_age_s_), 0, {}, {}, 0} : known->second;
  // Another program, or another run of it: its clock may have begun again.
  if (!is_new && source.client != client && observation.acquired_ns < source.last_acquired_ns) {
    source.clock = SourceClock(max_age_s_);
  }
  const std::uint64_t last_sequence = source.receipt.observation_sequence;  // 0: none
  if (!is_new && observation.sequence == last_sequence &&
      observation.acquired_ns == source.last_acquired_ns) {
    return Admission{source.receipt, 0, true};
  }
  if (observation.sequence > kMaxSequence) {
    return invalid(fmt::format("observation.sequence = {}: must be at most {}",
                               observation.sequence, kMaxSequence));
  }
  if (observation.sequence <= last_sequence) {
    return invalid(fmt::format(
        "observation.sequence = {}: must be above {}, the last one accepted from {}; a "
        "source that was started again numbers on from {}",
        observation.sequence, last_sequence, in_quotes(observation.source), last_sequence + 1));
  }
  const auto daemon_ns = recorded_clock_ ? recorded_time(observation)
                                         : source.clock.to_daemon(observation, arrived_ns);
  if (!daemon_ns) {
    // It remembers a jump that it refused; but not a clock that was to begin anew.
    if (!is_new && source.client == client) known->second.clock = source.clock;
    return tl::unexpected(daemon_ns.error());
  }
  source.last_acquired_ns = observation.acquired_ns;
  source.receipt = {observation.sequence, replaces_pending};
  source.client = client;
  source.arrived_ns = arrived_ns;
  const Admission admission{source.receipt, *daemon_ns, false};
  if (is_new && sources_.size() >= kMaxSources) sources_.erase(longest_silent());
  sources_.insert_or_assign(observation.source, source);
  return admission;
}

}  // namespace brainshift::server
