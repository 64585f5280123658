// SPDX-License-Identifier: GPL-3.0-or-later
// Broadcast: the OpenIGTLink messages of one picture, for clients of version 1 and of version 2.
// A message is encoded when the first client of its version gets to it, and shared by all.
//
//   brainshift        STATUS
//   brainshift_state  STRING    JSON
//   brainshift_u      IMAGE     float32 x 3
//   brainshift_sd     IMAGE     float32
//   brainshift_known  IMAGE     float32
//   brainshift_tumour, brainshift_cortex, brainshift_ventricles, brainshift_septa   POLYDATA
//
// Belongs to one thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "client/tools/bridge/picture.hpp"
#include "common/core/error.hpp"

namespace brainshift::client {

class Broadcast {
 public:
  enum class Part {
    kWhole,
    kState  // the first two messages alone: a sign of life, and the newest age
  };
  // message_id: of version 2.
  Broadcast(PicturePtr picture, Part part, std::uint32_t message_id);

  const Picture& picture() const { return *picture_; }
  const PicturePtr& picture_ptr() const { return picture_; }
  bool whole() const { return part_ == Part::kWhole; }
  std::size_t size() const { return shown_.size(); }
  // One message, 0 <= i < size(). Empty when it cannot be encoded: then error() says why.
  const std::string& bytes(std::size_t i, std::uint16_t version);
  const std::string& error() const { return error_; }
  // Of all messages that have been encoded.
  std::size_t held_bytes() const;

 private:
  enum class Device { kStatus, kState, kField, kSd, kKnown };
  using Shown = std::variant<Device, Shape>;
  Status encode(Shown shown, std::uint16_t version, std::string& out) const;

  PicturePtr picture_;
  Part part_;
  std::uint32_t message_id_;
  std::vector<Shown> shown_;
  std::array<std::vector<std::string>, 2> encoded_;  // of versions 1 and 2
  std::string error_;
};
using BroadcastPtr = std::shared_ptr<Broadcast>;

}  // namespace brainshift::client
