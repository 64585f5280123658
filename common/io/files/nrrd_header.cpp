// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/files/nrrd_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

Status store_line(NrrdHeader& header, std::string_view line) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || colon + 1 == line.size()) {
    return unreadable(fmt::format("header line \"{}\" has no value", line.substr(0, 60)));
  }
  const std::size_t skip = line[colon + 1] == '=' ? 2 : 1;
  const std::string_view name = trimmed(line.substr(0, colon));
  const bool is_new = header.fields.emplace(name, trimmed(line.substr(colon + skip))).second;
  if (!is_new) return unreadable(fmt::format("field {} is given twice", name));
  return {};
}

Status understand(NrrdHeader& header) {
  const std::string text = header.field("sizes");
  auto sizes = parse_sizes("sizes", text, 0);
  if (!sizes) return tl::unexpected(sizes.error());
  header.sizes = std::move(*sizes);
  const std::string dimension = header.field("dimension");
  if (header.sizes.empty() || std::to_string(header.sizes.size()) != dimension) {
    return unreadable(fmt::format("dimension = \"{}\" does not agree with the {} sizes \"{}\"",
                                  dimension, header.sizes.size(), text));
  }
  for (const char* key : {"data file", "line skip", "byte skip"}) {
    const std::string value = header.field(key);
    if (!value.empty() && value != "0") {
      return unreadable(
          fmt::format("{} = {}: its pixels lie elsewhere (a detached header); must follow the "
                      "header in the same file",
                      key, value));
    }
  }
  header.element_type = element_type(header.field("type"));
  const std::string encoding = header.word("encoding");
  header.compressed = encoding == "gzip" || encoding == "gz";
  if (!header.compressed && encoding != "raw") {
    return unreadable("encoding = " + encoding + ": must be raw or gzip");
  }
  const std::string endian = header.word("endian");
  if (!endian.empty() && endian != "little" && endian != "big") {
    return unreadable("endian = " + endian + ": must be little or big");
  }
  header.big_endian = endian == "big";
  return {};
}

}  // namespace

std::string_view take_line(std::string_view& rest) {
  const std::size_t end = std::min(rest.find('\n'), rest.size());
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return line;
}

bool BeforeByLetters::operator()(std::string_view a, std::string_view b) const {
  const auto next = [](std::string_view& name) {
    name.remove_prefix(std::min(name.find_first_not_of(" \t"), name.size()));
    if (name.empty()) return -1;
    const int letter = std::tolower(static_cast<unsigned char>(name.front()));
    name.remove_prefix(1);
    return letter;
  };
  while (true) {
    const int one = next(a), other = next(b);
    if (one != other || one < 0) return one < other;
  }
}

std::string NrrdHeader::field(const std::string& name) const {
  const auto found = fields.find(name);
  return found == fields.end() ? std::string() : found->second;
}

std::string NrrdHeader::word(const std::string& name) const { return lower_case(field(name)); }

Result<NrrdHeader> parse_nrrd_header(std::string_view content) {
  NrrdHeader header;
  std::string_view rest = content;
  if (!take_line(rest).starts_with("NRRD000")) return unreadable("is no NRRD file");
  while (true) {
    // A detached header may end without an empty line.
    if (rest.empty() && !header.field("data file").empty()) break;
    if (rest.empty() || content.size() - rest.size() > kLargestTextHeader) {
      return unreadable("its NRRD header has no end (an empty line)");
    }
    const std::string_view line = trimmed(take_line(rest));
    if (line.empty()) break;
    if (line.front() == '#') continue;
    if (Status ok = store_line(header, line); !ok) return tl::unexpected(ok.error());
  }
  header.data = rest;
  if (Status ok = understand(header); !ok) return tl::unexpected(ok.error());
  return header;
}

}  // namespace brainshift::io
