// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/key_writer.hpp"

#include <cstdio>

namespace brainshift::io {

namespace fs = std::filesystem;

void KeyWriter::operator()(const Key& key, const fs::path& value, Need) {
  line(key, quoted(value.empty() ? "" : fs::absolute(value).lexically_normal().string()));
}

std::string KeyWriter::digits(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.17g", value);
  return buffer;
}

std::string KeyWriter::list(const std::vector<double>& values) {
  std::string items;
  for (const double value : values) items.append(items.empty() ? "" : ", ").append(digits(value));
  return "[" + items + "]";
}

// Double-quoted YAML: only these need an escape in printable text; control characters by number.
std::string KeyWriter::quoted(const std::string& value) {
  std::string out = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      char buffer[8];
      std::snprintf(buffer, sizeof buffer, "\\x%02x", static_cast<unsigned>(c));
      out += buffer;
    } else {
      out += c;
    }
  }
  return out + "\"";
}

void KeyWriter::line(const Key& key, const std::string& value) {
  text_.append(2 * depth(), ' ').append(key.name).append(value.empty() ? ":" : ": ");
  text_.append(value).append("\n");
}

}  // namespace brainshift::io
