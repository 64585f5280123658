// SPDX-License-Identifier: GPL-3.0-or-later
// KeyDocumenter: what the documentation of a configuration file says of every key of a table
// (common/configuration/key_table.hpp).
#pragma once

#include <charconv>

#include "common/configuration/key_table.hpp"

namespace brainshift {

// What the documentation of a configuration file says in front of a key.
struct KeyDocument {
  std::string key;   // with its sections; for a kind also "tumour.ellipsoid"
  std::string text;  // "Gap between brain and skull, mm. Default 1 (paper); range 0 to 20. NOTE"
};

// Collects the documents of all keys of a default-made value, with all kinds and optional
// sections.
class KeyDocumenter : public KeyWalker<KeyDocumenter> {
 public:
  void operator()(const Key& key, double value, const Limits& limits);
  void operator()(const Key& key, double value, const Limits& limits, const SameAs& same);
  void operator()(const Key& key, const Vec3& value, const Limits& limits,
                  Need need = Need::kOptional);
  void operator()(const Key& key, const std::vector<double>& value, const Limits& limits);
  void operator()(const Key& key, const std::vector<int>& value, const Limits& limits);
  void operator()(const Key& key, const std::string& value, Need need = Need::kOptional);
  void operator()(const Key& key, const std::filesystem::path& value, Need need = Need::kOptional);
  void operator()(const Key& key, const std::optional<std::filesystem::path>& value);
  void operator()(const Key& key, const std::optional<std::string>& value);
  template <typename T, typename W, std::size_t N>
  void operator()(const Key& key, const T& value, const Word<W> (&words)[N]) {
    std::string list;
    for (const Word<W>& known : words) list.append(list.empty() ? "" : ", ").append(known.word);
    add(key, std::string("Default ") + word_of(value, words), "one of " + list);
  }
  template <typename... Kinds>
  void one_of(const Key& key, Need need, const std::variant<Kinds...>&) {
    const auto document = [this](const auto& kind) { visit_kind(*this, kind); };
    section(key, need, [&] { (document(Kinds{}), ...); });
  }
  template <typename Optional, typename Section>
  void section_if(const Key& key, Optional&, const Section& like) {
    section(key, Need::kOptional, [&] { visit(*this, like); });
  }
  template <typename Map, typename Section>
  void sections(const Key& key, Map&, const Section&) {
    open(key);
  }
  void open(const Key& key) { add(key, "", ""); }

  const std::vector<KeyDocument>& documents() const { return documents_; }

 private:
  void add(const Key& key, const std::string& standard, const std::string& range);
  std::vector<KeyDocument> documents_;
};

// Of all keys of a default-made configuration.
template <typename Config>
std::vector<KeyDocument> documents_of() {
  KeyDocumenter documenter;
  const Config defaults;
  visit(documenter, defaults);
  return documenter.documents();
}

// The shortest text of a number, with exponents as people write them: 1e6, 1e-7.
inline std::string digits(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  std::string text(buffer, error == std::errc() ? end : buffer);
  const std::size_t exponent = text.find('e');
  if (exponent == std::string::npos) return text;
  if (text[exponent + 1] == '+') text.erase(exponent + 1, 1);
  const std::size_t first = exponent + (text[exponent + 1] == '-' ? 2 : 1);
  while (text[first] == '0' && first + 1 < text.size()) text.erase(first, 1);
  return text;
}

template <typename List>
std::string digits_of_list(const List& values) {
  std::string text;
  for (const double value : values) text.append(text.empty() ? "" : ", ").append(digits(value));
  return "[" + text + "]";
}

// "range 0 to 20"; for the entries of a list "each 0 to 20".
inline std::string range_of(const Limits& limits, const char* word) {
  switch (limits.kind) {
    case Limits::Kind::kNone:
    case Limits::Kind::kFinite: return {};
    case Limits::Kind::kNotNegative: return "at least 0";
    case Limits::Kind::kDirection: return "any length but 0";
    case Limits::Kind::kBetween:
      return std::string(word) + " " + digits(limits.low) + " to " +
             (limits.high_key != nullptr ? limits.high_key : digits(limits.high));
  }
  return {};
}

inline void KeyDocumenter::add(const Key& key, const std::string& standard,
                               const std::string& range) {
  std::string text = key.meaning;
  if (*key.unit != '\0') text.append(", ").append(key.unit);
  if (!text.empty()) text += ".";
  if (!standard.empty()) {
    text.append(" ").append(standard);
    if (*key.source != '\0') text.append(" (").append(key.source).append(")");
    text.append(range.empty() ? "" : "; ").append(range).append(".");
  }
  if (*key.note != '\0') text.append(text.empty() ? "" : " ").append(key.note);
  documents_.push_back({full(key), text});
}

inline void KeyDocumenter::operator()(const Key& key, double value, const Limits& limits) {
  add(key, "Default " + digits(value), range_of(limits, "range"));
}

inline void KeyDocumenter::operator()(const Key& key, double, const Limits& limits,
                                      const SameAs& same) {
  add(key, std::string("Default ") + same.key, range_of(limits, "range"));
}

inline void KeyDocumenter::operator()(const Key& key, const Vec3& value, const Limits& limits,
                                      Need need) {
  add(key, need == Need::kRequired ? "No default" : "Default " + digits_of_list(value),
      range_of(limits, "each"));
}

inline void KeyDocumenter::operator()(const Key& key, const std::vector<double>& value,
                                      const Limits& limits) {
  add(key, "Default " + digits_of_list(value), range_of(limits, "each"));
}

inline void KeyDocumenter::operator()(const Key& key, const std::vector<int>& value,
                                      const Limits&) {
  add(key, "Default " + digits_of_list(std::vector<double>(value.begin(), value.end())), "");
}

inline void KeyDocumenter::operator()(const Key& key, const std::string& value, Need need) {
  if (need == Need::kRequired) return add(key, "No default", "not empty");
  add(key, "Default " + (value.empty() ? "none" : value), "");
}

inline void KeyDocumenter::operator()(const Key& key, const std::filesystem::path&, Need need) {
  add(key, need == Need::kRequired ? "No default" : "Default none", "");
}

inline void KeyDocumenter::operator()(const Key& key, const std::optional<std::filesystem::path>&) {
  add(key, "Default none", "");
}

inline void KeyDocumenter::operator()(const Key& key, const std::optional<std::string>&) {
  add(key, "Default none", "not empty");
}

}  // namespace brainshift
