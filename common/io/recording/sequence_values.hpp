// SPDX-License-Identifier: GPL-3.0-or-later
// The pixels behind the header of an image sequence.
#pragma once

#include <string>

#include "common/core/error.hpp"
#include "common/io/recording/sequence_header.hpp"

namespace brainshift::io {

// The pixels as the file orders them, expanded, in native byte order: product(sizes) x
// bytes_per_value. kUnreadable for data that are truncated, damaged, longer than the sizes say, or
// above 8 GiB.
Result<std::string> sequence_values(const SequenceHeader& header, int bytes_per_value);

}  // namespace brainshift::io
