// SPDX-License-Identifier: GPL-3.0-or-later
// Watches a daemon: subscribes with a choice and tells a line per update. It starts no session and
// sends no observation. A daemon that goes away is told too, and watched again when it comes back.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/lib/client_keys.hpp"
#include "client/lib/field_status.hpp"
#include "common/core/error.hpp"
#include "common/geometry/tumour_motion.hpp"
#include "common/values/brain_model.hpp"
#include "common/values/session_state.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {

// A viewer's choice as it is written on a command line.
//
//   length   40mm, 0.1mm                  a number with its unit; mm is the only one
//   region   brain                        everything
//            tumour:40mm                  the tumour and what lies within 40 mm of it
//            -30,12.5,44:40mm             a ball: centre (patient RAS, mm) and radius
struct ChoiceText {
  std::string region = "brain";
  std::string spacing = "0mm";    // 0mm: every node
  std::string tolerance = "0mm";  // 0mm: every node of every update
  bool without_sd = false;
};

// kInvalidArgument or kNotFinite: the sentence names the option, its text and what it must be.
Result<FieldChoice> parse_choice(const ChoiceText& text);
// A length in mm. kInvalidArgument: the sentence names the option, its text and what it must be.
Result<double> parse_length(std::string_view option, std::string_view text);

struct WatchOptions {
  std::string endpoint = "tcp://127.0.0.1:5555";
  FieldChoice choice = {};
  std::uint64_t count = 0;                        // updates to tell, failures too; 0: for ever
  bool json = false;                              // a line is an object
  std::optional<ClientKeys> keys = std::nullopt;  // for a daemon that asks for keys
};

// What a line tells of an update.
struct WatchedUpdate {
  std::uint64_t sequence = 0;
  std::string failure;  // why there is no field; empty with a field
  std::string quality;  // of the field
  std::string doubt;    // why it is not good
  AnswerTime answer_time;
  int nodes = 0;           // that the viewer now has
  int mesh_nodes = 0;      // of the whole mesh
  int received_nodes = 0;  // that travelled
  std::size_t received_bytes = 0;
  std::optional<geometry::TumourMotion> tumour;  // of the tumour's nodes among them
  FieldStatus status;            // of the newest usable field, when the line was told
  std::string method, boundary;  // of the update
};

WatchedUpdate watched(const UpdateMessage& message, const std::vector<NodeIndex>& tumour,
                      int mesh_nodes);
// Text: the update's number, age, motion of the tumour, verdict, boundary and currency in 80
// columns; what more there is (reasons, a late answer, a part of the nodes) in indented lines of
// as many.
std::string watch_line(const WatchedUpdate& update, bool json);

// Tells lines until `count` updates are told. kUnavailable and others: no daemon at the beginning,
// or it refuses the choice.
Status watch(const WatchOptions& options, const std::function<void(const std::string&)>& tell);

}  // namespace brainshift::client
