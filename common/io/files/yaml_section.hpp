// SPDX-License-Identifier: GPL-3.0-or-later
// A YAML document read strictly: every key must be known, every value of its type, nothing twice.
//
// Usage: open a document, take values by key, ask for status(). The first problem wins and
// all later calls do nothing, so a reader is a plain list of keys. Keys that are missing are told
// together, in one message.
//   YamlDocument document = YamlDocument::parse(text, file);
//   YamlSection material = document.root().section("material");
//   material.number("poisson_ratio", config.material.poisson_ratio);   // optional: default stays
//   material.done();                                                    // unknown keys are errors
//   Status status = document.status();
// Messages: "FILE:LINE: KEY = VALUE: must be ...", KEY with its sections
// ("material.poisson_ratio").
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

enum class Presence { kOptional, kRequired };
inline constexpr Presence kRequired = Presence::kRequired;

class YamlSection;

class YamlDocument {
 public:
  // Never fails to construct: problems of the text itself are in status().
  static YamlDocument parse(const std::string& text, const std::filesystem::path& file);
  YamlDocument(YamlDocument&&) noexcept;
  ~YamlDocument();

  YamlSection root();
  // Ok, or the first problem.
  Status status() const;
  // Puts file and line in front of a message that begins with a key ("a.b[1] = 3: must be ...").
  Error locate(const Error& error) const;

  struct State;

 private:
  explicit YamlDocument(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

// A mapping of the document; valid as long as the document.
class YamlSection {
 public:
  bool has(const std::string& key);
  // Whether the section is there and holds keys.
  bool given() const { return node_ != nullptr; }
  // A missing optional section has no keys.
  YamlSection section(const std::string& key, Presence presence = Presence::kOptional);
  // Which one of `keys` is present; "" (and an error, if required) for none or several.
  std::string one_of(const std::vector<std::string>& keys, Presence presence);

  void number(const std::string& key, double& value, Presence presence = Presence::kOptional);
  void integer(const std::string& key, int& value, Presence presence = Presence::kOptional);
  void text(const std::string& key, std::string& value, Presence presence = Presence::kOptional);
  // One of `words`.
  void choice(const std::string& key, std::string& value, const std::vector<std::string>& words);
  // Relative paths are taken from the document's folder; the result is absolute. Empty text:
  // empty path.
  void path(const std::string& key, std::filesystem::path& value,
            Presence presence = Presence::kOptional);
  // [x, y, z]
  void vector3(const std::string& key, Vec3& value, Presence presence = Presence::kOptional);
  // [a, b, ...], possibly empty
  void numbers(const std::string& key, std::vector<double>& value,
               Presence presence = Presence::kOptional);
  // a, or [a, b, ...]; at least one
  void integers(const std::string& key, std::vector<int>& value,
                Presence presence = Presence::kOptional);
  // All keys, in order, for sections whose keys are names; they count as known.
  std::vector<std::string> names();
  // Records that a key is wrong in a way that only its reader knows: "KEY: what".
  void fail(const std::string& key, const std::string& what);
  // Every key of the section must have been asked for.
  void done();

 private:
  friend class YamlDocument;
  struct Node;
  YamlSection(YamlDocument::State& state, std::shared_ptr<Node> node, std::string prefix);
  // The value of a key, or null (and an error, if required).
  std::shared_ptr<Node> take(const std::string& key, Presence presence);
  std::string full_key(const std::string& key) const;
  int line_of_key(const std::string& key) const;  // for messages; 0 if unknown
  // "KEY = VALUE: what".
  void refuse_value(const std::string& key, const Node& node, const std::string& what);

  YamlDocument::State* state_;
  std::shared_ptr<Node> node_;  // null: section is absent
  std::string prefix_;
  std::vector<std::string> known_;
};

// A value out of a document: read(root, value) takes every key, and check(value) judges the value
// when each key is good by itself. A message of check begins with a key and gets file and line.
template <typename T, typename Read, typename Check>
Result<T> parse_yaml(const std::string& text, const std::filesystem::path& file, const Read& read,
                     const Check& check) {
  YamlDocument document = YamlDocument::parse(text, file);
  YamlSection root = document.root();
  T value;
  read(root, value);
  root.done();
  if (Status status = document.status(); !status) return tl::unexpected(status.error());
  if (Status status = check(value); !status) return tl::unexpected(document.locate(status.error()));
  return value;
}

}  // namespace brainshift::io
