// SPDX-License-Identifier: GPL-3.0-or-later
// The text headers of MetaImage (.mha) and NRRD image sequences, and where their pixels begin.
//
// MetaImage: lines "Key = value" up to and with "ElementDataFile = LOCAL". NRRD: a magic line,
// lines "field: value" and "key:=value" and comments "#" up to an empty line. Fields of frame i
// are called "Seq_Frame000i_Name" in both. Of either only what a sequence of single-channel
// images needs is understood; the rest of the fields is kept as text. Sources: MetaIO
// documentation (itk.org), teem.sourceforge.net/nrrd/format.html, PLUS user manual "Sequence
// file".
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"

namespace brainshift::io {

struct SequenceHeader {
  std::vector<std::int64_t> sizes;  // fastest first, each 1 to 1e6
  std::string element_type;         // "uint8", "int16", "uint16", "float", or as the file has it
  bool big_endian = false;
  bool compressed = false;
  std::map<std::string, std::string> fields;  // of the whole file, MetaImage names
  // Fields of each frame, "ProbeToTrackerTransform" for Seq_Frame0012_ProbeToTrackerTransform; by
  // frame number.
  std::map<int, std::map<std::string, std::string>> frames;
  std::string_view data;  // the bytes behind the header; refers to the content that was parsed
};

// "Seq_Frame0012_NAME".
std::string frame_field(int frame, const std::string& name);

// kUnreadable with a sentence that names the field and its value, without the file.
Result<SequenceHeader> parse_meta_header(std::string_view content);
Result<SequenceHeader> parse_nrrd_header(std::string_view content);

}  // namespace brainshift::io
