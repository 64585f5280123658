// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/vtk_xml.hpp"

#include <bit>
#include <charconv>
#include <limits>
#include <map>
#include <pugixml.hpp>

#include "common/io/files/binary_codec.hpp"

namespace brainshift::io {
namespace {

// deflate cannot do better than about 1032:1; a header that promises more lies.
constexpr std::size_t kLargestBlockExpansion = 1040;

tl::unexpected<Error> unreadable(const std::string& message) {
  return fail(ErrorCode::kUnreadable, message);
}

std::size_t size_of_type(const std::string& type) {
  static const std::map<std::string, std::size_t> kSizes = {
      {"Int8", 1},   {"UInt8", 1}, {"Int16", 2},  {"UInt16", 2},  {"Int32", 4},
      {"UInt32", 4}, {"Int64", 8}, {"UInt64", 8}, {"Float32", 4}, {"Float64", 8}};
  const auto found = kSizes.find(type);
  return found == kSizes.end() ? 0 : found->second;
}

template <typename T, typename Out>
void append_all(const std::string& bytes, bool swap, std::vector<Out>& out) {
  out.reserve(bytes.size() / sizeof(T));
  for (std::size_t i = 0; i + sizeof(T) <= bytes.size(); i += sizeof(T)) {
    out.push_back(static_cast<Out>(load_number<T>(bytes.data() + i, swap)));
  }
}

void numbers_from_bytes(const std::string& bytes, bool swap, VtkArray& array) {
  if (array.type == "Float32") append_all<float>(bytes, swap, array.reals);
  if (array.type == "Float64") append_all<double>(bytes, swap, array.reals);
  if (array.type == "Int8") append_all<std::int8_t>(bytes, swap, array.integers);
  if (array.type == "UInt8") append_all<std::uint8_t>(bytes, swap, array.integers);
  if (array.type == "Int16") append_all<std::int16_t>(bytes, swap, array.integers);
  if (array.type == "UInt16") append_all<std::uint16_t>(bytes, swap, array.integers);
  if (array.type == "Int32") append_all<std::int32_t>(bytes, swap, array.integers);
  if (array.type == "UInt32") append_all<std::uint32_t>(bytes, swap, array.integers);
  if (array.type == "Int64") append_all<std::int64_t>(bytes, swap, array.integers);
  if (array.type == "UInt64") append_all<std::uint64_t>(bytes, swap, array.integers);
}

// All numbers of white-space separated text; false at anything else.
template <typename T>
bool parse_numbers(std::string_view text, std::vector<T>& out) {
  const char* at = text.data();
  const char* end = at + text.size();
  while (true) {
    while (at != end && (*at == ' ' || *at == '\n' || *at == '\r' || *at == '\t')) ++at;
    if (at == end) return true;
    T value{};
    const auto [stop, error] = std::from_chars(at, end, value);
    if (error != std::errc()) return false;
    out.push_back(value);
    at = stop;
  }
}

struct Encoding {
  bool swap = false;
  bool wide_header = false;  // UInt64 block headers
  bool compressed = false;
};

Result<std::size_t> read_header_number(ByteSource& source, const Encoding& encoding) {
  const Result<std::string> bytes = source.read(encoding.wide_header ? 8 : 4);
  if (!bytes) return tl::unexpected(bytes.error());
  return encoding.wide_header
             ? static_cast<std::size_t>(load_number<std::uint64_t>(bytes->data(), encoding.swap))
             : static_cast<std::size_t>(load_number<std::uint32_t>(bytes->data(), encoding.swap));
}

// [blocks][block size][last block size or 0][compressed sizes...] then the blocks.
Result<std::string> read_compressed(ByteSource& source, const Encoding& encoding) {
  std::size_t header[3];
  for (std::size_t& number : header) {
    const Result<std::size_t> read = read_header_number(source, encoding);
    if (!read) return tl::unexpected(read.error());
    number = *read;
  }
  const auto [blocks, block_size, last_size] = header;
  if (blocks > source.remaining()) return unreadable("more blocks promised than bytes are left");
  std::vector<std::size_t> sizes(blocks);
  for (std::size_t& size : sizes) {
    const Result<std::size_t> read = read_header_number(source, encoding);
    if (!read) return tl::unexpected(read.error());
    size = *read;
  }
  std::string out;
  for (std::size_t i = 0; i < blocks; ++i) {
    const std::size_t expanded = i + 1 == blocks && last_size != 0 ? last_size : block_size;
    if (sizes[i] > source.remaining() || expanded / kLargestBlockExpansion > sizes[i]) {
      return unreadable("a block's size is impossible");
    }
    const Result<std::string> compressed = source.read(sizes[i]);
    if (!compressed) return tl::unexpected(compressed.error());
    const Result<std::string> block = zlib_expand(*compressed, expanded);
    if (!block) return tl::unexpected(block.error());
    out += *block;
  }
  return out;
}

Result<std::string> read_block(ByteSource& source, const Encoding& encoding) {
  if (encoding.compressed) return read_compressed(source, encoding);
  const Result<std::size_t> size = read_header_number(source, encoding);
  if (!size) return tl::unexpected(size.error());
  return source.read(*size);
}

}  // namespace

struct VtkXmlFile::Impl {
  std::string content;
  pugi::xml_document xml;
  pugi::xml_node grid;
  pugi::xml_node piece;
  Encoding encoding;
  std::string_view appended;  // after the underscore
  bool appended_is_raw = false;

  std::vector<pugi::xml_node> arrays(const std::string& section) const {
    std::vector<pugi::xml_node> nodes;
    for (const pugi::xml_node& node : piece.child(section.c_str()).children("DataArray")) {
      nodes.push_back(node);
    }
    return nodes;
  }
  Result<std::string> bytes_of(const pugi::xml_node& node) const;
  Result<std::string> text_of(const pugi::xml_node& node) const;
  Status fill(const pugi::xml_node& node, VtkArray& array) const;
  // Raw appended data are no XML, so they are cut out before parsing.
  Status cut_appended();
  Status find_piece(const std::string& grid_name);
};

Status VtkXmlFile::Impl::cut_appended() {
  const std::size_t begin = content.find("<AppendedData");
  if (begin == std::string::npos) return {};
  const std::size_t close = content.find('>', begin);
  const std::size_t underscore = content.find('_', close);
  if (close == std::string::npos || underscore == std::string::npos) {
    return unreadable("AppendedData has no data");
  }
  appended_is_raw = content.substr(begin, close - begin).find("\"base64\"") == std::string::npos;
  appended = std::string_view(content).substr(underscore + 1);
  if (!appended_is_raw) appended = appended.substr(0, appended.find('<'));
  return {};
}

Status VtkXmlFile::Impl::find_piece(const std::string& grid_name) {
  const pugi::xml_node root = xml.child("VTKFile");
  if (!root) return unreadable("is not a VTK XML file");
  if (root.attribute("type").as_string() != grid_name) {
    return unreadable("holds '" + std::string(root.attribute("type").as_string()) + "': must be '" +
                      grid_name + "'");
  }
  const std::string compressor = root.attribute("compressor").as_string();
  if (!compressor.empty() && compressor != "vtkZLibDataCompressor") {
    return unreadable("compressor '" + compressor + "' is not supported: must be zlib or none");
  }
  const bool big =
      std::string(root.attribute("byte_order").as_string("LittleEndian")) == "BigEndian";
  encoding.swap = big == (std::endian::native == std::endian::little);
  encoding.wide_header = std::string(root.attribute("header_type").as_string("UInt32")) == "UInt64";
  encoding.compressed = !compressor.empty();
  grid = root.child(grid_name.c_str());
  piece = grid.child("Piece");
  if (!piece) return unreadable("has no Piece");
  if (piece.next_sibling("Piece")) return unreadable("has several pieces: must have one");
  return {};
}

Result<std::string> VtkXmlFile::Impl::bytes_of(const pugi::xml_node& node) const {
  const std::string format = node.attribute("format").as_string();
  if (format == "binary") {
    Base64Source source(node.text().get());
    return read_block(source, encoding);
  }
  if (format != "appended") return unreadable("format '" + format + "' is unknown");
  const auto offset = node.attribute("offset").as_ullong(std::numeric_limits<std::uint64_t>::max());
  if (offset >= appended.size()) return unreadable("offset lies behind the appended data");
  const std::string_view from = appended.substr(offset);
  if (appended_is_raw) {
    RawSource source(from);
    return read_block(source, encoding);
  }
  Base64Source source(from);
  return read_block(source, encoding);
}

// VTK writes a text as the codes of its characters and a 0: as numbers (ascii) or as bytes.
Result<std::string> VtkXmlFile::Impl::text_of(const pugi::xml_node& node) const {
  const std::string type = node.attribute("type").as_string();
  if (type != "String") return unreadable("has type '" + type + "': must be String");
  std::string text;
  if (std::string(node.attribute("format").as_string("ascii")) == "ascii") {
    std::vector<int> codes;
    if (!parse_numbers(std::string_view(node.text().get()), codes)) {
      return unreadable("holds something that is not the code of a character");
    }
    for (const int code : codes) {
      if (code < 0 || code > 255) return unreadable("holds a code that is no character");
      text.push_back(static_cast<char>(code));
    }
  } else {
    Result<std::string> bytes = bytes_of(node);
    if (!bytes) return bytes;
    text = std::move(*bytes);
  }
  if (!text.empty() && text.back() == '\0') text.pop_back();
  if (text.find('\0') != std::string::npos) return unreadable("holds several texts: must be one");
  return text;
}

Status VtkXmlFile::Impl::fill(const pugi::xml_node& node, VtkArray& array) const {
  if (std::string(node.attribute("format").as_string("ascii")) == "ascii") {
    const std::string_view text = node.text().get();
    const bool ok =
        array.is_real() ? parse_numbers(text, array.reals) : parse_numbers(text, array.integers);
    if (!ok) return unreadable("holds something that is not a number of type " + array.type);
    return {};
  }
  const Result<std::string> bytes = bytes_of(node);
  if (!bytes) return tl::unexpected(bytes.error());
  if (bytes->size() % size_of_type(array.type) != 0) return unreadable("ends inside a number");
  numbers_from_bytes(*bytes, encoding.swap, array);
  return {};
}

VtkXmlFile::VtkXmlFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
VtkXmlFile::VtkXmlFile(VtkXmlFile&&) noexcept = default;
VtkXmlFile::~VtkXmlFile() = default;

Result<VtkXmlFile> VtkXmlFile::parse(std::string content, const std::string& grid) {
  auto impl = std::make_unique<Impl>();
  impl->content = std::move(content);
  if (Status cut = impl->cut_appended(); !cut) return tl::unexpected(cut.error());
  std::string xml_text = impl->content;
  if (impl->appended.data() != nullptr) {
    xml_text.resize(xml_text.find("<AppendedData"));
    xml_text += "</VTKFile>";
  }
  const pugi::xml_parse_result parsed = impl->xml.load_buffer(xml_text.data(), xml_text.size());
  if (!parsed) return unreadable(std::string("is not well-formed XML: ") + parsed.description());
  if (Status found = impl->find_piece(grid); !found) return tl::unexpected(found.error());
  return VtkXmlFile(std::move(impl));
}

Result<std::optional<std::string>> VtkXmlFile::field_text(const std::string& name) const {
  for (const pugi::xml_node& node : impl_->grid.child("FieldData").children()) {
    if (node.attribute("Name").as_string() != name) continue;
    Result<std::string> text = impl_->text_of(node);
    if (!text) return unreadable("FieldData array '" + name + "' " + text.error().message);
    return std::move(*text);
  }
  return std::nullopt;
}

Result<std::int64_t> VtkXmlFile::count(const std::string& attribute) const {
  const std::string text = impl_->piece.attribute(attribute.c_str()).as_string("0");
  std::vector<std::int64_t> values;
  // Mesh indices are int.
  if (!parse_numbers(text, values) || values.size() != 1 || values[0] < 0 ||
      values[0] > std::numeric_limits<int>::max()) {
    return unreadable(attribute + " = " + text + ": must be a count");
  }
  return values[0];
}

std::vector<std::string> VtkXmlFile::array_names(const std::string& section) const {
  std::vector<std::string> names;
  for (const pugi::xml_node& node : impl_->arrays(section)) {
    names.emplace_back(node.attribute("Name").as_string());
  }
  return names;
}

bool VtkXmlFile::is_real_array(const std::string& section, std::size_t index) const {
  const std::string type = impl_->arrays(section).at(index).attribute("type").as_string();
  return type == "Float32" || type == "Float64";
}

Result<VtkArray> VtkXmlFile::array(const std::string& section, std::size_t index,
                                   std::int64_t tuples) const {
  const std::vector<pugi::xml_node> nodes = impl_->arrays(section);
  if (index >= nodes.size()) return unreadable(section + " has no array");
  const pugi::xml_node node = nodes[index];
  VtkArray array;
  array.name = node.attribute("Name").as_string();
  array.type = node.attribute("type").as_string();
  array.components = node.attribute("NumberOfComponents").as_int(1);
  const std::string place = section + " array '" + array.name + "'";
  if (size_of_type(array.type) == 0)
    return unreadable(place + " has unknown type '" + array.type + "'");
  if (array.components < 1) return unreadable(place + " has no components");
  if (Status filled = impl_->fill(node, array); !filled) {
    return unreadable(place + ": " + filled.error().message);
  }
  const std::size_t size = array.is_real() ? array.reals.size() : array.integers.size();
  if (tuples >= 0 &&
      size != static_cast<std::size_t>(tuples) * static_cast<std::size_t>(array.components)) {
    return unreadable(place + " has " + std::to_string(size) + " numbers: must have " +
                      std::to_string(tuples) + " x " + std::to_string(array.components));
  }
  return array;
}

Result<VtkArray> VtkXmlFile::array(const std::string& section, const std::string& name,
                                   std::int64_t tuples) const {
  const std::vector<std::string> names = array_names(section);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return array(section, i, tuples);
  }
  return unreadable(section + " has no array '" + name + "'");
}

}  // namespace brainshift::io
