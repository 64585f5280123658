// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/pipeline/evidence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace brainshift::pipeline {
namespace {

SparseData named(SparseData data, const std::string& source) {
  data.sources = {{source, 0, data.size()}};
  return data;
}

}  // namespace

void Evidence::clear() {
  newest_.clear();
  quarantined_.clear();
}

std::vector<Omission> Evidence::put(RegisteredObservation observation) {
  const std::int64_t now_ns = observation.acquired_ns;
  std::string newest = observation.source;
  quarantined_.erase(newest);
  newest_.insert_or_assign(std::move(newest), std::move(observation));
  std::vector<Omission> omissions;
  for (const auto& [source, other] : newest_) {
    const double age = age_s(other, now_ns);
    if (age <= max_age_s_) continue;
    omissions.push_back({"source " + source,
                         fmt::format("observation {} is {:.0f} s old, sensing.max_age_s = {:g}",
                                     other.sequence, age, max_age_s_),
                         "what it would have shown is not known"});
  }
  return omissions;
}

std::vector<Omission> Evidence::drop_quarantined(const std::string& source, std::int64_t now_ns) {
  std::vector<Omission> omissions;
  for (const std::string& other : std::set<std::string>(quarantined_)) {
    const auto found = newest_.find(other);
    if (other == source || found == newest_.end() || age_s(found->second, now_ns) > max_age_s_) {
      continue;
    }
    omissions.push_back({"source " + other,
                         fmt::format("no usable estimate could be made with observation {}, alone "
                                     "or beside this one",
                                     found->second.sequence),
                         "what it would have shown is not known"});
    quarantined_.erase(other);
    newest_.erase(found);
  }
  return omissions;
}

// A replay that begins again jumps back in time. The future then counts as much as the past.
double Evidence::age_s(const RegisteredObservation& observation, std::int64_t now_ns) const {
  return std::abs(static_cast<double>(now_ns) - static_cast<double>(observation.acquired_ns)) / 1e9;
}

CombinedData::CombinedData(const Evidence& evidence, std::int64_t now_ns) {
  for (const auto& [source, observation] : evidence.newest_) {
    if (evidence.age_s(observation, now_ns) > evidence.max_age_s_) continue;
    if (observation.surface) {
      followers_.push_back({&observation, parts_.size(), {}});
      parts_.push_back(named(observation.surface->first(), source));
    } else {
      parts_.push_back(observation.data);
    }
  }
  // The union of the followers' nodes, and the place of each follower's nodes in it.
  std::vector<NodeIndex>& all = moving_.nodes;
  for (const Follower& follower : followers_) {
    const std::vector<NodeIndex>& own = follower.observation->surface->nodes();
    all.insert(all.end(), own.begin(), own.end());
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  for (Follower& follower : followers_) {
    for (const NodeIndex node : follower.observation->surface->nodes()) {
      const auto place = std::lower_bound(all.begin(), all.end(), node);
      follower.columns.push_back(static_cast<int>(place - all.begin()));
    }
  }
  data_ = combine(parts_);
  moving_.relocate = std::bind_front(&CombinedData::relocate, this);
}

bool CombinedData::relocate(const Points& u, SparseData& data) {
  bool moved = false;
  for (const Follower& follower : followers_) {
    const RegisteredObservation& observation = *follower.observation;
    SparseData now =
        named(observation.surface->at(u(Eigen::all, follower.columns)), observation.source);
    if (!observation.surface->moved(parts_[follower.part], now)) continue;
    parts_[follower.part] = std::move(now);
    moved = true;
  }
  if (moved) data = combine(parts_);
  return moved;
}

}  // namespace brainshift::pipeline
