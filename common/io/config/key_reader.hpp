// SPDX-License-Identifier: GPL-3.0-or-later
// Visitor of a key table (values/key_table.hpp) that takes the values from a YAML section. A key
// that is not in the table is an error; what is not given keeps its value.
#pragma once

#include <charconv>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/configuration/key_table.hpp"
#include "common/io/files/yaml_section.hpp"

namespace brainshift::io {

class KeyReader {
 public:
  // `root` outlives the reader. Its unknown keys are reported by root.done(), which the caller
  // calls.
  explicit KeyReader(YamlSection& root) : here_(&root) {}

  void operator()(const Key& key, double& value, const Limits&) { here_->number(key.name, value); }
  void operator()(const Key& key, double& value, const Limits&, const SameAs& same) {
    value = same.value;
    here_->number(key.name, value);
  }
  void operator()(const Key& key, int& value, const Limits&) { here_->integer(key.name, value); }
  void operator()(const Key& key, Vec3& value, const Limits&, Need need = Need::kOptional) {
    here_->vector3(key.name, value, presence(need));
  }
  void operator()(const Key& key, std::vector<double>& value, const Limits&) {
    here_->numbers(key.name, value);
  }
  void operator()(const Key& key, std::vector<int>& value, const Limits&) {
    here_->integers(key.name, value);
  }
  void operator()(const Key& key, std::string& value, Need need = Need::kOptional) {
    here_->text(key.name, value, presence(need));
  }
  void operator()(const Key& key, std::filesystem::path& value, Need need = Need::kOptional) {
    here_->path(key.name, value, presence(need));
  }
  void operator()(const Key& key, std::optional<std::string>& value) {
    if (here_->has(key.name)) here_->text(key.name, value.emplace(), Presence::kRequired);
  }
  // A key that is there must name a file.
  void operator()(const Key& key, std::optional<std::filesystem::path>& value) {
    if (here_->has(key.name)) here_->path(key.name, value.emplace(), Presence::kRequired);
  }
  template <typename T, typename W, std::size_t N>
  void operator()(const Key& key, T& value, const Word<W> (&words)[N]) {
    std::vector<std::string> known;
    for (const Word<W>& word : words) known.emplace_back(word.word);
    std::string found = word_of(value, words);
    here_->choice(key.name, found, known);
    for (const Word<W>& word : words) {
      if (found == word.word) value = word.value;
    }
  }

  template <typename Body>
  void section(const Key& key, Need need, Body&& body) {
    YamlSection keys = here_->section(key.name, presence(need));
    YamlSection* const outer = here_;
    here_ = &keys;
    body();
    keys.done();
    here_ = outer;
  }
  // A section that names no kind keeps the first one.
  template <typename... Kinds>
  void one_of(const Key& key, Need need, std::variant<Kinds...>& value) {
    section(key, need, [&] {
      const std::string found = here_->one_of({kind_name(Kinds{})...}, presence(need));
      ((found == kind_name(Kinds{}) ? void(value = Kinds{}) : void()), ...);
      std::visit([this](auto& kind) { visit_kind(*this, kind); }, value);
    });
  }
  template <typename Section>
  void section_if(const Key& key, std::optional<Section>& value, const Section& like) {
    if (!here_->has(key.name)) return;
    value = like;
    section(key, Need::kOptional, [&] { visit(*this, *value); });
  }
  template <typename Section>
  void sections(const Key& key, std::map<int, Section>& values, const Section& like) {
    section(key, Need::kOptional, [&] {
      for (const std::string& label : here_->names()) {
        int number = 0;
        const char* const end = label.data() + label.size();
        const auto [stop, error] = std::from_chars(label.data(), end, number);
        if (error != std::errc() || stop != end) {
          return here_->fail(label, "must be a label of the mesh, a whole number");
        }
        Section& value = values[number] = like;
        section({label.c_str()}, Need::kOptional, [&] { visit(*this, value); });
      }
    });
  }

 private:
  static Presence presence(Need need) {
    return need == Need::kRequired ? Presence::kRequired : Presence::kOptional;
  }
  YamlSection* here_;
};

}  // namespace brainshift::io
