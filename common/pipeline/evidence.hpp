// SPDX-License-Identifier: GPL-3.0-or-later
// Evidence: the newest registered observation of every source of a session, and what an update
// makes of them.
//
// Sources are used together. An update that the tumour's boundary asks for also uses the newest
// view of the cortex, as long as that view is not older than sensing.max_age_s by the observations'
// own clock.
//
// An observation whose own update was unusable is *quarantined*: it may be wrong, or other sources
// may be missing. The next update tries with it. If that one is usable, it is trusted again; else
// it is forgotten, and the update is made without it. Not thread-safe.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/inversion/contract/inversion_options.hpp"
#include "common/pipeline/registration_stage.hpp"
#include "common/values/estimate.hpp"

namespace brainshift::pipeline {

class Evidence {
 public:
  explicit Evidence(double max_age_s) : max_age_s_(max_age_s) {}
  void clear();
  // Replaces the earlier observation of the same source, quarantined or not. Why others are not
  // used together with it, for Update::left_out.
  std::vector<Omission> put(RegisteredObservation observation);
  // Forgets the source's observation: no estimate could be made with it.
  void drop(const std::string& source) { newest_.erase(source); }
  // No usable estimate could be made with the source's observation and the others.
  void quarantine(const std::string& source) { quarantined_.insert(source); }
  // A usable estimate was made with all that are fresh.
  void trust() { quarantined_.clear(); }
  // Forgets the quarantined ones that are fresh, but not that of `source`. Which they were and why
  // they are not used, for Update::left_out; empty when there was none.
  std::vector<Omission> drop_quarantined(const std::string& source, std::int64_t now_ns);

  // nullptr: the source has not observed, or was dropped.
  const RegisteredObservation* newest(const std::string& source) const {
    const auto found = newest_.find(source);
    return found == newest_.end() ? nullptr : &found->second;
  }

 private:
  friend class CombinedData;
  double age_s(const RegisteredObservation& observation, std::int64_t now_ns) const;

  double max_age_s_;
  std::map<std::string, RegisteredObservation> newest_;
  std::set<std::string> quarantined_;  // sources
};

// Data of the evidence's fresh observations as one, in the order of their sources' names. Data that
// follow the deformation begin where their observation alone says (SurfaceDistances::first), so
// that an estimate does not depend on earlier ones. They are measured anew whenever the inversion
// asks with a displacement.
class CombinedData {
 public:
  CombinedData(const Evidence& evidence, std::int64_t now_ns);

  const SparseData& data() const { return data_; }
  // Null when nothing moves. Valid as long as this object.
  const inversion::MovingData* moving() const { return followers_.empty() ? nullptr : &moving_; }

  CombinedData(const CombinedData&) = delete;
  CombinedData& operator=(const CombinedData&) = delete;

 private:
  // An observation (and part) that follows the deformation.
  struct Follower {
    const RegisteredObservation* observation = nullptr;
    std::size_t part = 0;
    std::vector<int> columns;  // of its nodes among moving_.nodes
  };
  bool relocate(const Points& u, SparseData& data);

  std::vector<SparseData> parts_;
  std::vector<Follower> followers_;
  inversion::MovingData moving_;
  SparseData data_;
};

}  // namespace brainshift::pipeline
