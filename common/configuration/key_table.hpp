// SPDX-License-Identifier: Apache-2.0
// Tables of configuration keys: a key is named once; reading, writing, checking and documenting
// it follow from the table.
//
// A table is a function visit(a, v) for each struct v that has keys. It makes one call per key:
//   a({name, unit, meaning, source, note}, v.member, between(0, 20));
// The default is the member's value in a default-made struct. Visitors:
//   KeyChecker  here, the ranges    io::KeyReader  from YAML    io::KeyWriter  to YAML
// Tests compare the documented files with a text for every key (tests/support/key_documenter.hpp).
// `a` also takes groups of keys:
//   section(key, need, body)            keys below a heading
//   one_of(key, need, variant)          a heading with one kind out of several; each kind has a
//                                       kind_name(x) and a visit_kind(a, x)
//   section_if(key, optional, like)     a heading that may be absent; keys not given: as in `like`
//   sections(key, map, like)            one heading for each label, a whole number
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift {

struct Key {
  const char* name;
  const char* unit = "";     // as in the documentation: "mm"
  const char* meaning = "";  // without the full stop: "Gap between brain and skull"
  const char* source = "";   // of the default: "paper, section 2.6"
  const char* note = "";     // further sentences
};

enum class Need { kOptional, kRequired };

// What a number must be; of a vector or list, what each entry must be.
struct Limits {
  enum class Kind { kNone, kFinite, kNotNegative, kBetween, kDirection };
  Kind kind = Kind::kNone;
  double low = 0.0, high = 0.0;    // kBetween; both ends are valid
  const char* high_key = nullptr;  // the key whose value `high` is, for the documentation
};
constexpr Limits unlimited() { return {}; }
constexpr Limits finite() { return {Limits::Kind::kFinite}; }
constexpr Limits not_negative() { return {Limits::Kind::kNotNegative}; }
constexpr Limits direction() { return {Limits::Kind::kDirection}; }  // any length but 0
constexpr Limits between(double low, double high, const char* high_key = nullptr) {
  return {Limits::Kind::kBetween, low, high, high_key};
}

// A default that is the value of another key.
struct SameAs {
  double value;
  const char* key;
};

// The word that stands for a value.
template <typename T>
struct Word {
  T value;
  const char* word;
};
template <typename T, typename W, std::size_t N>
const char* word_of(const T& value, const Word<W> (&words)[N]) {
  for (const Word<W>& known : words) {
    if (value == known.value) return known.word;
  }
  return "";
}

// V is T or const T: a table serves visitors that write to the values and those that only look.
template <typename V, typename T>
concept Of = std::same_as<std::remove_const_t<V>, T>;

// Walks over the groups of a table; Derived has a call operator for each kind of value.
template <typename Derived>
class KeyWalker {
 public:
  template <typename Body>
  void section(const Key& key, Need, Body&& body) {
    const std::string outer = prefix_;
    self().open(key);
    prefix_ += std::string(key.name) + ".";
    body();
    prefix_ = outer;
  }
  template <typename Variant>
  void one_of(const Key& key, Need need, Variant& value) {
    section(key, need,
            [&] { std::visit([this](auto& kind) { visit_kind(self(), kind); }, value); });
  }
  template <typename Optional, typename Section>
  void section_if(const Key& key, Optional& value, const Section&) {
    if (value) section(key, Need::kOptional, [&] { visit(self(), *value); });
  }
  template <typename Map, typename Section>
  void sections(const Key& key, Map& values, const Section&) {
    if (values.empty()) return;
    section(key, Need::kOptional, [&] {
      for (auto& [label, value] : values) {
        const std::string name = std::to_string(label);
        section({name.c_str()}, Need::kOptional, [&, &one = value] { visit(self(), one); });
      }
    });
  }

 protected:
  void open(const Key&) {}
  // With the sections that it is in: "material.poisson_ratio".
  std::string full(const Key& key) const { return prefix_ + key.name; }
  // How deep the walk is: 1 inside a section of the file.
  std::size_t depth() const {
    return static_cast<std::size_t>(std::count(prefix_.begin(), prefix_.end(), '.'));
  }

 private:
  Derived& self() { return static_cast<Derived&>(*this); }
  std::string prefix_;
};

// "KEY = VALUE: must be CONSTRAINT", the value with six digits.
std::string must_be(const std::string& key, double value, const std::string& constraint);

// Compares every value with its limits and keeps the first violation.
class KeyChecker : public KeyWalker<KeyChecker> {
 public:
  template <typename... More>
  void operator()(const Key& key, double value, const Limits& limits, const More&...) {
    check(full(key), value, limits);
  }
  void operator()(const Key& key, const Vec3& value, const Limits& limits, Need = Need::kOptional);
  void operator()(const Key& key, const std::vector<double>& value, const Limits& limits);
  // At least one, each once.
  void operator()(const Key& key, const std::vector<int>& value, const Limits& limits);
  // A text that is needed must not be empty.
  void operator()(const Key& key, const std::string& value, Need need = Need::kOptional);
  // A text that may be left out must not be empty where it is given.
  void operator()(const Key& key, const std::optional<std::string>& value) {
    if (value) (*this)(key, *value, Need::kRequired);
  }
  void operator()(const Key&, const std::filesystem::path&, Need = Need::kOptional) {}
  void operator()(const Key&, const std::optional<std::filesystem::path>&) {}
  template <typename T, typename W, std::size_t N>
  void operator()(const Key&, const T&, const Word<W> (&)[N]) {}

  // "KEY: what", for a rule about several keys.
  void require(bool ok, const std::string& key, const std::string& what);
  // Ok, or kInvalidArgument: "KEY = VALUE: must be CONSTRAINT", the key with its sections.
  Status status() const;

 private:
  void check(bool ok, const std::string& key, double value, const std::string& constraint);
  void check(const std::string& key, double value, const Limits& limits);
  std::string message_;
};

}  // namespace brainshift
