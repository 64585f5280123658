// SPDX-License-Identifier: GPL-3.0-or-later
// What this process may take of the system: descriptors, and so connections; memory.
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

// From here on a block of 4 MiB or more has pages of its own, which go when it is freed. Otherwise
// the C library learns from every large block that was freed, up to 32 MiB, and keeps what follows:
// 32 peers with an unfinished message of 15 MiB each, of which three were held at a time, left 145
// MiB behind; so 46 MiB, which is what was held. Call it once, before other threads allocate.
void return_large_blocks();

}  // namespace brainshift::server
