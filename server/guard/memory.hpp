// SPDX-License-Identifier: GPL-3.0-or-later
// Memory that libzmq has freed goes back to the system.
#pragma once

namespace brainshift::server {

// From here on a block of 4 MiB or more has pages of its own, which go when it is freed. Otherwise
// the C library learns from every large block that was freed, up to 32 MiB, and keeps what follows:
// 32 peers with an unfinished message of 15 MiB each, of which three were held at a time, left 145
// MiB behind; so 46 MiB, which is what was held. Call it once, before other threads allocate.
void return_large_blocks();

}  // namespace brainshift::server
