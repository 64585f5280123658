// SPDX-License-Identifier: GPL-3.0-or-later
// Recordings of tracked ultrasound as the PLUS Toolkit and 3D Slicer write them: MetaImage
// sequences (.mha: .igs.mha, .seq.mha) and NRRD sequences (.nrrd), pixels in the same file, raw
// or compressed, 8 or 16 bit, one channel.
//
// Of every frame i: Seq_Frame000i_Timestamp (s), _ImageStatus (in PLUS's .nrrd files _Status; OK,
// INVALID; absent: OK), and for every transform _ProbeToTrackerTransform (16 numbers, row by row)
// with _ProbeToTrackerTransformStatus (OK; anything else: invalid). A matrix whose status is OK but
// that is no rigid motion (no invertible map, where a frame of pixels is involved) makes that
// frame's link invalid and is listed in Recording::defects.
//
// UltrasoundImageOrientation says where image axes point: first letter for u, second for v (M
// marked side of the probe, U unmarked, F far from it, N near), a third for the slice direction,
// which single images do not have. Images are turned into MF, as PLUS does before it applies
// ImageToProbe. Other orders of axes (FU, AMF, ...) are refused. Source: PLUS user manual,
// "Sequence file format" and "Ultrasound image orientation".
#pragma once

#include <filesystem>
#include <string>

#include "common/core/error.hpp"
#include "common/tracking/recording.hpp"

namespace brainshift::io {

struct SequenceOptions {
  // Taken for a file that does not say; empty: such a file is refused.
  std::string orientation;
  // Times and transforms alone: images are neither needed nor read, and their state does not count.
  // The recording then has width and height 0. PLUS writes such files ("DimSize = 0 0 N") where it
  // recorded a tracker without images; without this option they are refused.
  bool tracking_only = false;
};

// kNotFound; kUnreadable, naming file, frame, field and value: no such format, sizes that
// disagree with the pixels or the frames' fields, truncated or damaged pixels, a frame without a
// time, a clock that runs backwards, a matrix that is not 16 numbers.
Result<tracking::Recording> read_sequence(const std::filesystem::path& path,
                                          const SequenceOptions& options = {});

}  // namespace brainshift::io
