// SPDX-License-Identifier: GPL-3.0-or-later
// What the kernel says of this process: memory, descriptors, threads.
#pragma once

#include "common/wire/report.hpp"

namespace brainshift::server {

// From /proc/self; a figure that cannot be read is 0.
wire::ProcessFigures process_figures();

}  // namespace brainshift::server
