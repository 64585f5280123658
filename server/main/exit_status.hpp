// SPDX-License-Identifier: GPL-3.0-or-later
// What the shell sees: 0 success, 2 bad usage or bad input, 1 failure; one line on stderr for 1 and 2.
#pragma once

#include "common/core/error.hpp"

namespace brainshift::server {

inline constexpr int kExitSuccess = 0;
inline constexpr int kExitFailure = 1;
inline constexpr int kExitBadInput = 2;

// Errors that the user mends by giving something else are bad input, the others failures.
int exit_status(ErrorCode code);

// Prints "brainshiftd: <message>" to stderr, on one line whatever the message holds.
int print_error(const Error& error);

}  // namespace brainshift::server
