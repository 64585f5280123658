// SPDX-License-Identifier: GPL-3.0-or-later
// The text headers of MetaImage (.mha) and NRRD image sequences, and where their pixels begin.
//
// MetaImage: lines "Key = value" up to and with "ElementDataFile = LOCAL". NRRD: files/nrrd_header.
// Fields of frame i are called "Seq_Frame000i_Name" in both. Of either only what a sequence of
// single-channel images needs is understood; the rest of the fields is kept as text. Sources:
// MetaIO documentation (itk.org), PLUS user manual "Sequence file".
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "common/core/error.hpp"
#include "common/io/files/nrrd_header.hpp"

namespace brainshift::io {

// Its fields, by MetaImage names, are those of the whole file.
struct SequenceHeader : NrrdHeader {
  // Fields of each frame, "ProbeToTrackerTransform" for Seq_Frame0012_ProbeToTrackerTransform; by
  // frame number.
  std::map<int, std::map<std::string, std::string>> frames;
};

// "Seq_Frame0012_NAME".
std::string frame_field(int frame, const std::string& name);

// kUnreadable with a sentence that names the field and its value, without the file.
Result<SequenceHeader> parse_meta_sequence(std::string_view content);
Result<SequenceHeader> parse_nrrd_sequence(std::string_view content);

}  // namespace brainshift::io
