// SPDX-License-Identifier: GPL-3.0-or-later
// The text header of an NRRD file whose values follow in the same file, raw or gzip.
//
// A magic line, then lines "field: value", "key:=value" and comments "#" up to an empty line.
// Source: teem.sourceforge.net/nrrd/format.html.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>

#include "common/core/error.hpp"
#include "common/io/files/packed_values.hpp"

namespace brainshift::io {

// Bytes, of MetaImage headers too; a file whose header does not end before that is refused.
inline constexpr std::size_t kLargestTextHeader = std::size_t{256} << 20;

// Cuts the first line off and returns it, without its line feed.
std::string_view take_line(std::string_view& rest);

// The order of names in which neither case nor blanks count (NRRD: "Space Directions" is
// "spacedirections"; MetaImage's readers differ).
struct BeforeByLetters {
  bool operator()(std::string_view a, std::string_view b) const;
};

struct NrrdHeader : PackedValues {
  std::map<std::string, std::string, BeforeByLetters> fields;  // of both kinds of line, as text

  // Empty where there is none.
  std::string field(const std::string& name) const;
  // The same in lower case, for words in which case does not count.
  std::string word(const std::string& name) const;
};

// kUnreadable with a sentence that names the field and its value, without the file: no NRRD, a
// header without an end, a field without a value or given twice, `dimension` that disagrees with
// `sizes`, an encoding other than raw and gzip, values in another file (a detached header, .nhdr).
Result<NrrdHeader> parse_nrrd_header(std::string_view content);

}  // namespace brainshift::io
