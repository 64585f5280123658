// SPDX-License-Identifier: GPL-3.0-or-later
// What the shell sees of a failure: one line on stderr and an exit
// status (common/core/exit_status.hpp).
#pragma once

#include "common/core/error.hpp"
#include "common/core/exit_status.hpp"

namespace brainshift::server {

// Prints "brainshiftd: <message>" to stderr, on one line whatever the message holds. A reader
// that stalls is not waited for beyond half a second. Returns the exit status of the error's code.
int print_error(const Error& error);

}  // namespace brainshift::server
