// SPDX-License-Identifier: GPL-3.0-or-later
// On what updates are computed. Two updates are comparable bit for bit only where build, machine
// type and BLAS kernel agree (docs/conventions.md).
#pragma once

#include <string>
#include <string_view>

namespace brainshift::server {

// "0.1.0 crc 1a2b3c4d": the version, and the checksum of the running program's file. Without the
// checksum where the file cannot be read.
std::string program_build(std::string_view version);

// "x86_64 GenuineIntel family 6 model 143": what the processor calls its type; the architecture
// alone where it does not tell.
std::string machine_type();

// The same from a text like /proc/cpuinfo.
std::string machine_type(std::string_view architecture, std::string_view cpu_info);

}  // namespace brainshift::server
