// SPDX-License-Identifier: GPL-3.0-or-later
// Visitor of a key table (values/key_table.hpp) that writes every key with its value as YAML:
// absolute paths, numbers with 17 significant digits, which give every double back.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/configuration/key_table.hpp"

namespace brainshift::io {

class KeyWriter : public KeyWalker<KeyWriter> {
 public:
  template <typename... More>
  void operator()(const Key& key, double value, const Limits&, const More&...) {
    line(key, digits(value));
  }
  void operator()(const Key& key, int value, const Limits&) { line(key, std::to_string(value)); }
  void operator()(const Key& key, const Vec3& value, const Limits&, Need = Need::kOptional) {
    line(key, list({value.begin(), value.end()}));
  }
  void operator()(const Key& key, const std::vector<double>& value, const Limits&) {
    line(key, list(value));
  }
  void operator()(const Key& key, const std::string& value, Need = Need::kOptional) {
    line(key, quoted(value));
  }
  void operator()(const Key& key, const std::filesystem::path& value, Need = Need::kOptional);
  void operator()(const Key& key, const std::optional<std::filesystem::path>& value) {
    if (value) (*this)(key, *value);
  }
  void operator()(const Key& key, const std::optional<std::string>& value) {
    if (value) (*this)(key, *value);
  }
  template <typename T, typename W, std::size_t N>
  void operator()(const Key& key, const T& value, const Word<W> (&words)[N]) {
    line(key, quoted(word_of(value, words)));
  }
  void open(const Key& key) { line(key, ""); }

  const std::string& text() const { return text_; }

 private:
  static std::string digits(double value);
  static std::string list(const std::vector<double>& values);
  static std::string quoted(const std::string& value);
  void line(const Key& key, const std::string& value);
  std::string text_;
};

}  // namespace brainshift::io
