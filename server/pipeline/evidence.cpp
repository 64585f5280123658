// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/pipeline/evidence.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace brainshift::server {
namespace {

SparseData measured(const RegisteredObservation& observation, const Points& u) {
  SparseData data = observation.surface->at(u);
  data.sources = {{observation.source, 0, data.size()}};
  return data;
}

}  // namespace

void Evidence::clear() {
  newest_.clear();
  cortex_.resize(3, 0);
}

void Evidence::put(RegisteredObservation observation) {
  std::string source = observation.source;
  newest_.insert_or_assign(std::move(source), std::move(observation));
}

// A replay that begins again jumps back in time. The future then counts as much as the past.
double Evidence::age_s(const RegisteredObservation& observation, std::int64_t now_ns) const {
  return std::abs(static_cast<double>(now_ns) - static_cast<double>(observation.acquired_ns)) / 1e9;
}

std::vector<const RegisteredObservation*> Evidence::fresh(std::int64_t now_ns) const {
  std::vector<const RegisteredObservation*> result;
  for (const auto& [source, observation] : newest_) {
    if (age_s(observation, now_ns) <= max_age_s_) result.push_back(&observation);
  }
  return result;
}

std::vector<Omission> Evidence::stale(std::int64_t now_ns) const {
  std::vector<Omission> omissions;
  for (const auto& [source, observation] : newest_) {
    const double age = age_s(observation, now_ns);
    if (age <= max_age_s_) continue;
    omissions.push_back({"source " + source,
                         fmt::format("observation {} is {:.0f} s old, sensing.max_age_s = {:g}",
                                     observation.sequence, age, max_age_s_),
                         "what it would have shown is not known"});
  }
  return omissions;
}

Points Evidence::cortex(const std::vector<NodeIndex>& nodes) const {
  if (cortex_.cols() == 0) return Points::Zero(3, static_cast<Eigen::Index>(nodes.size()));
  return cortex_;
}

void Evidence::remember(const Points& displacement, const std::vector<NodeIndex>& nodes) {
  cortex_ = displacement(Eigen::all, nodes);
}

CombinedData::CombinedData(std::vector<const RegisteredObservation*> observations,
                           const Evidence& evidence)
    : observations_(std::move(observations)) {
  for (const RegisteredObservation* observation : observations_) {
    if (!observation->surface) {
      parts_.push_back(observation->data);
      continue;
    }
    surfaces_.push_back(parts_.size());
    moving_.nodes = observation->surface->nodes();  // the craniotomy's, for every surface
    parts_.push_back(measured(*observation, evidence.cortex(moving_.nodes)));
  }
  data_ = combine(parts_);
  moving_.relocate = [this](const Points& u, SparseData& data) { return relocate(u, data); };
}

bool CombinedData::relocate(const Points& u, SparseData& data) {
  bool moved = false;
  for (const std::size_t part : surfaces_) {
    SparseData now = measured(*observations_[part], u);
    if (!observations_[part]->surface->moved(parts_[part], now)) continue;
    parts_[part] = std::move(now);
    moved = true;
  }
  if (moved) data = combine(parts_);
  return moved;
}

void CombinedData::describe(std::int64_t now_ns, std::vector<SourceSummary>& sources) const {
  for (SourceSummary& summary : sources) {
    for (const RegisteredObservation* observation : observations_) {
      if (observation->source != summary.source) continue;
      summary.observation_sequence = observation->sequence;
      summary.outliers += observation->outliers;
      summary.age_s = 1e-9 * static_cast<double>(now_ns - observation->acquired_ns);
    }
  }
}

}  // namespace brainshift::server
