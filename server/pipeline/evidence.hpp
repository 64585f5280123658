// SPDX-License-Identifier: GPL-3.0-or-later
// Evidence: the newest registered observation of every source of a session, and what an update makes of them.
//
// Sources are used together: an update that the tumour's boundary asks for also uses the cortex as it was seen last, as
// long as that is not older than sensing.max_age_s by the observations' own clock. Not thread-safe.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/values/estimate.hpp"
#include "common/inversion/contract/moving_data.hpp"
#include "server/pipeline/registration_stage.hpp"

namespace brainshift::server {

class Evidence {
 public:
  explicit Evidence(double max_age_s) : max_age_s_(max_age_s) {}
  void clear();
  // Replaces what its source said before.
  void put(RegisteredObservation observation);
  // An observation that an update could not be made of is not used again.
  void drop(const std::string& source) { newest_.erase(source); }

  // Observations to be used with one of this time, in the order of their sources' names.
  std::vector<const RegisteredObservation*> fresh(std::int64_t now_ns) const;
  // Why the others are not, for Update::left_out.
  std::vector<Omission> stale(std::int64_t now_ns) const;

  // Displacement of the cortex in the last estimate, 3 x nodes; zero before the first.
  Points cortex(const std::vector<NodeIndex>& nodes) const;
  void remember(const Points& displacement) { last_ = displacement; }

 private:
  double age_s(const RegisteredObservation& observation, std::int64_t now_ns) const;

  double max_age_s_;
  std::map<std::string, RegisteredObservation> newest_;
  Points last_;  // 3 x n, or no columns
};

// Data of several observations as one. Those that follow the deformation are measured for the displacement `u_of` of
// their nodes.
class CombinedData {
 public:
  CombinedData(std::vector<const RegisteredObservation*> observations, const Evidence& evidence);

  const SparseData& data() const { return data_; }
  // Null when nothing moves. Valid as long as this object.
  const inversion::MovingData* moving() const { return surfaces_.empty() ? nullptr : &moving_; }
  // Fills observation_sequence and age of the estimate's sources.
  void describe(std::int64_t now_ns, std::vector<SourceSummary>& sources) const;

  CombinedData(const CombinedData&) = delete;
  CombinedData& operator=(const CombinedData&) = delete;

 private:
  bool relocate(const Points& u, SparseData& data);

  std::vector<const RegisteredObservation*> observations_;
  std::vector<SparseData> parts_;
  std::vector<std::size_t> surfaces_;  // observations (and parts) that follow the deformation
  inversion::MovingData moving_;
  SparseData data_;
};

}  // namespace brainshift::server
