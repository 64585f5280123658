// SPDX-License-Identifier: GPL-3.0-or-later
// Per-frame fields of a sequence header to times, image states and links.
#pragma once

#include "common/core/error.hpp"
#include "common/io/recording/sequence_header.hpp"
#include "common/tracking/recording.hpp"

namespace brainshift::io {

// Fills time_s, image_ok, links and defects for `count` frames. kUnreadable naming frame and
// field.
Status read_frame_fields(const SequenceHeader& header, int count, tracking::Recording& recording);

}  // namespace brainshift::io
