// SPDX-License-Identifier: GPL-3.0-or-later
// RouterOptions: where the daemon listens, what it admits, and how long it waits.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

#include "server/security/gate.hpp"

namespace brainshift::server {

struct RouterOptions {
  std::string endpoint = "tcp://127.0.0.1:*";
  int max_clients = 32;
  int max_message_mib = 16;
  int max_connections = 256;           // more than clients: who says nothing useful takes one too
  std::size_t held_bytes = 48u << 20;  // of messages that are not complete or not taken yet
  std::chrono::milliseconds patience{30000};  // with a peer of which nothing can be delivered
  int send_queue = 16;                        // messages that may wait per peer
  std::chrono::milliseconds heartbeat_interval{1000};
  std::chrono::milliseconds heartbeat_timeout{5000};
  std::chrono::milliseconds handshake_limit{2000};
  // How long the loop may wait before it calls RequestHandler::turned() again; -1: for ever.
  std::chrono::milliseconds longest_wait{-1};
  std::optional<ServerKeys> keys;  // nullopt: any peer that can connect has full access
  Limits limits;
};

}  // namespace brainshift::server
