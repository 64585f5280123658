// SPDX-License-Identifier: GPL-3.0-or-later
// Frames, and every message that a daemon or a client decodes. The bytes are a frame, and a
// payload too: behind the frame's checksum a fuzzer would never come.
#include "common/wire/convert.hpp"
#include "common/wire/frame.hpp"
#include "common/wire/published_update.hpp"
#include "common/wire/report.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace brainshift::fuzz {
namespace {

void decode_all(std::string_view payload) {
  (void)wire::decode_status(payload);
  (void)wire::decode_session_request(payload);
  (void)wire::decode_session_info(payload);
  (void)wire::decode_observation_receipt(payload);
  if (const auto subscription = wire::decode_subscription(payload)) {
    require(wire::decode_subscription(wire::encode(*subscription)) == *subscription,
            "a subscription that was decoded is the same when it is decoded again");
  }
  (void)wire::decode_decision(payload);
  (void)wire::decode_error(payload);
  if (const auto observation = wire::decode_observation(payload)) {
    require(wire::decode_observation(wire::encode(*observation)).has_value(),
            "an observation that was decoded can be decoded again");
  }
  if (const auto report = wire::decode_report(payload)) {
    require(wire::decode_report(wire::encode(*report)).has_value(),
            "a report that was decoded can be decoded again");
  }
  if (const auto state = wire::decode_session_state(payload)) {
    require(wire::decode_session_state(wire::encode(*state)).has_value(),
            "a state that was decoded can be decoded again");
  }
  if (const auto update = wire::decode_update(payload)) {
    require(wire::decode_update(wire::encode(*update)).has_value(),
            "an update that was decoded can be decoded again");
    if (const auto whole = wire::PublishedUpdate::open(payload)) {
      std::optional<FieldPart> first;
      if (whole->nodes() > 0) first = FieldPart{whole->nodes(), {0}, 0};
      require(wire::decode_update(whole->cut(first, true)).has_value(),
              "a part of an update that was decoded can be decoded");
    }
  }
  if (const auto model = wire::decode_model(payload)) {
    require(wire::decode_model(wire::encode(*model)).has_value(),
            "a model that was decoded can be decoded again");
  }
}

}  // namespace

void run(std::string_view bytes) {
  if (const auto frame = wire::decode_frame(bytes)) decode_all(frame->payload);
  decode_all(bytes);
}

}  // namespace brainshift::fuzz
