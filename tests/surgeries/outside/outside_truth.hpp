// SPDX-License-Identifier: GPL-3.0-or-later
// Truths from outside: the displacement of a head in a surgery of one kind (kinds.hpp), by a
// forward solution of its own (contact_body.hpp, outside_head.hpp).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "tests/surgeries/outside/kinds.hpp"

namespace brainshift::outside {

struct OutsideTruth {
  Points displacement;  // 3 x nodes of the case's mesh, mm
  Points quadratic;     // the same field: 3 x nodes of the head's space, mm
  // What moved it, N, 3 x nodes of any space of the head; while the truths' head lives.
  std::function<Points(const fem::DisplacementSpace&)> load;
  double largest_mm = 0.0;
  double load_scale = 1.0;
  double min_volume_ratio = 1.0;            // of the case's mesh, cavities apart
  int pressed = 0;                          // sides that touch the skull
  double volume_loss = 0.0;                 // Event::lost
  std::optional<double> resected_fraction;  // Event
};

// Truths of one head. Kinds without changes of tissue and supports share one factor per seed.
class OutsideTruths {
 public:
  // model, config: as the estimate knows the case. Errors of make_outside_head.
  static Result<std::unique_ptr<OutsideTruths>> make(const BrainModel& model,
                                                     const CaseConfig& config);

  // The same kind and seed give the same truth. Where an element of the case's mesh would be turned
  // inside out, the largest motion is made smaller by kLess until none is, kTries times at most.
  // kNotConverged: it still is, contact does not settle, or a geometry on the way to a large strain
  // cannot be solved. Other errors of ContactBody.
  Result<OutsideTruth> make(const Kind& kind, std::uint64_t seed);
  static constexpr double kLess = 0.8;
  static constexpr int kTries = 8;
  // Of every tetrahedron of the case's mesh: volume after over before is at least this.
  static constexpr double kLeastVolume = 0.1;

  const OutsideHead& head() const { return head_; }

 private:
  OutsideTruths(const BrainModel& model, OutsideHead head);
  struct Moved {
    Points u;  // 3 x nodes of the space, mm
    VecX pressing;
  };
  Result<Moved> moved(ContactBody& body, const Event& event, const VecX& gaps, const Points& load,
                      double scale, std::uint64_t seed) const;
  Result<Moved> follow(const Event& event, const VecX& gaps, double scale,
                       std::uint64_t seed) const;
  Result<ContactBody*> body_of(const Changes& changes, std::uint64_t seed);
  OutsideTruth judged(const Event& event, const Moved& moved, double scale) const;

  const BrainModel& model_;
  OutsideHead head_;
  std::vector<char> tissue_;  // work: per tetrahedron of the case's mesh
  std::uint64_t plain_seed_ = 0;
  std::unique_ptr<ContactBody> plain_, changed_;
};

}  // namespace brainshift::outside
