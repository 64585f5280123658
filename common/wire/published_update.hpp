// SPDX-License-Identifier: Apache-2.0
// PublishedUpdate: an update as it was encoded for everyone, opened so that parts of its field can
// be cut. What is not field is kept as bytes and never encoded again.
//
// decode_update(cut(part, sd)) is decode_update(payload) with the columns of the part alone: the
// numbers are the same 32-bit floats.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/values/estimate.hpp"
#include "common/values/session_state.hpp"

namespace brainshift::wire {

class PublishedUpdate {
 public:
  // kProtocol: malformed, of a part already, or with a number of values that does not fit.
  static Result<PublishedUpdate> open(std::string_view payload);

  const SessionKey& session() const { return session_; }
  std::uint64_t sequence() const { return sequence_; }
  bool usable() const { return usable_; }  // final, with a field that may be shown

  // Of the field; 0: it has none.
  int nodes() const { return static_cast<int>(xyz_mm_.size() / 3); }
  const std::vector<float>& xyz_mm() const { return xyz_mm_; }  // 3 per node
  const std::vector<float>& sd_mm() const { return sd_mm_; }    // one per node, or none
  const std::string& known() const { return known_; }           // a byte per node, or none

  // The payload with the nodes of the part only; empty: all nodes. sd: with standard deviations and
  // what is known.
  // Precondition: the part is of this update's mesh.
  std::string cut(const std::optional<FieldPart>& part, bool sd) const;

 private:
  SessionKey session_;
  std::uint64_t sequence_ = 0;
  bool usable_ = false;
  std::vector<float> xyz_mm_;
  std::vector<float> sd_mm_;
  std::string known_;
  std::string rest_;  // everything but the field
};

}  // namespace brainshift::wire
