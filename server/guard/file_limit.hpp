// SPDX-License-Identifier: GPL-3.0-or-later
// How many descriptors this process may have, and how many connections that allows.
#pragma once

namespace brainshift::server {

// Raises the soft limit to the hard one, where that is allowed. The limit that holds now.
long raise_file_limit();

// Kept for what is not a connection: journal, model, logs, libzmq's own.
inline constexpr long kReservedFiles = 96;
// A connection has its own, and the two ends of the way to the daemon's socket.
inline constexpr long kFilesPerConnection = 3;

// So many connections leave the reserve alone: at least 1, at most 1024.
int connections_within(long file_limit);

}  // namespace brainshift::server
