// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/config_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "common/configuration/case_keys.hpp"
#include "common/io/config/key_reader.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/geometry/label_map_file.hpp"
#include "common/io/geometry/label_names.hpp"
#include "common/io/geometry/mesh_file.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

// Length 1. A direction that has it already keeps its bits, so that a stored case reads back
// unchanged.
Vec3 unit(const Vec3& direction) {
  const double length = direction.norm();
  return std::abs(length - 1.0) < 1e-15 ? direction : direction / length;
}

std::string yaml_list(const std::vector<double>& values) {
  return fmt::format("[{:.17g}]", fmt::join(values, ", "));
}

// Visitor of a key table (configuration/key_table.hpp) that writes every key with its value as
// YAML: absolute paths, numbers with 17 significant digits, which give every double back.
class KeyWriter : public KeyWalker<KeyWriter> {
 public:
  template <typename... More>
  void operator()(const Key& key, double value, const Limits&, const More&...) {
    line(key, fmt::format("{:.17g}", value));
  }
  void operator()(const Key& key, int value, const Limits&) { line(key, std::to_string(value)); }
  void operator()(const Key& key, const Vec3& value, const Limits&, Need = Need::kOptional) {
    line(key, yaml_list({value.begin(), value.end()}));
  }
  void operator()(const Key& key, const std::vector<double>& value, const Limits&) {
    line(key, yaml_list(value));
  }
  void operator()(const Key& key, const std::vector<int>& value, const Limits&) {
    line(key, value.size() == 1 ? std::to_string(value[0])
                                : fmt::format("[{}]", fmt::join(value, ", ")));
  }
  void operator()(const Key& key, const std::string& value, Need = Need::kOptional) {
    line(key, yaml_text(value));
  }
  void operator()(const Key& key, const fs::path& value, Need = Need::kOptional) {
    line(key, yaml_text(value.empty() ? "" : fs::absolute(value).lexically_normal().string()));
  }
  template <typename T>
  void operator()(const Key& key, const std::optional<T>& value) {
    if (value) (*this)(key, *value);
  }
  template <typename T, typename W, std::size_t N>
  void operator()(const Key& key, const T& value, const Word<W> (&words)[N]) {
    line(key, yaml_text(word_of(value, words)));
  }
  void open(const Key& key) { line(key, ""); }
  template <typename Body>
  void section(const Key& key, Need need, Body&& body) {
    const bool idle = !labels_ && std::find(std::begin(kNeedLabels), std::end(kNeedLabels),
                                            full(key)) != std::end(kNeedLabels);
    if (!idle) KeyWalker::section(key, need, body);
  }

  // labels: the case has anatomy.labels.
  explicit KeyWriter(bool labels) : labels_(labels) {}
  const std::string& text() const { return text_; }

 private:
  void line(const Key& key, const std::string& value) {
    text_.append(2 * depth(), ' ').append(key.name).append(value.empty() ? ":" : ": ");
    text_.append(value).append("\n");
  }
  bool labels_;
  std::string text_;
};

// Fails for each section of kNeedLabels that holds keys.
void refuse_without_labels(YamlSection& root) {
  for (const std::string key : kNeedLabels) {
    const std::size_t dot = key.find('.');
    YamlSection outer = dot == std::string::npos ? root : root.section(key.substr(0, dot));
    const std::string name = key.substr(dot == std::string::npos ? 0 : dot + 1);
    if (!outer.section(name).given()) continue;
    outer.fail(name,
               "does nothing without anatomy.labels, the label map of the head: give it, or "
               "leave this section out");
  }
}

Result<CaseConfig> parse_case(const std::string& text, const fs::path& file, bool by_hand) {
  const auto read = [by_hand](YamlSection& root, CaseConfig& config) {
    KeyReader reader(root);
    visit(reader, config);
    if (by_hand && !config.anatomy.labels) refuse_without_labels(root);
  };
  const auto check = [](const CaseConfig& config) { return brainshift::validate(config); };
  auto config = parse_yaml<CaseConfig>(text, file, read, check);
  if (!config) return config;
  config->file = fs::absolute(file).lexically_normal();
  config->gravity_direction = unit(config->gravity_direction);
  config->craniotomy.long_axis_direction = unit(config->craniotomy.long_axis_direction);
  return config;
}

// Puts what the files of a case hold into their places.
class Loader {
 public:
  // go_on: after the first error too.
  Loader(const CaseConfig& config, bool go_on) : config_(config), go_on_(go_on) {}

  // Puts what `read` makes of the file into its place. The first error stays; it names the key.
  template <typename Read, typename T>
  void load(const fs::path& member, const Read& read, std::optional<T>& place) {
    if (!status_ && !go_on_) return;
    auto result = read(member);
    if (result) {
      place = std::move(*result);
    } else {
      blame(member, result.error());
    }
  }
  void look_up(const fs::path& member) {
    if (member.empty() || (!status_ && !go_on_)) return;
    if (Status found = check_regular_file(member); !found) blame(member, found.error());
  }
  const Status& status() const { return status_; }

 private:
  void blame(const fs::path& member, const Error& error) {
    if (status_) status_ = fail(error.code, key_of(config_, member) + ": " + error.message);
  }
  const CaseConfig& config_;
  bool go_on_;
  Status status_;
};

ReadableInputs load(const CaseConfig& config, bool go_on) {
  CaseInputs inputs;
  inputs.config = config;
  Loader loader(config, go_on);
  loader.look_up(config.mri);
  if (const auto* file = std::get_if<MeshFile>(&config.mesh)) {
    loader.load(file->path, read_tet_mesh, inputs.mesh);
  } else {
    loader.load(config.brain, read_volume, inputs.brain);
  }
  if (const auto* label = std::get_if<TumourLabel>(&config.tumour)) {
    const LabelChoice choice{label->segment.value_or(""), label->labels.front()};
    const auto read = [&](const fs::path& path) { return read_label_map(path, choice); };
    loader.load(label->path, read, inputs.tumour_labels);
  } else if (const auto* surface = std::get_if<TumourSurfaceFile>(&config.tumour)) {
    loader.load(surface->path, read_surface, inputs.tumour_surface);
  }
  if (config.contact.skull_file) {
    loader.load(*config.contact.skull_file, read_surface, inputs.skull);
  }
  if (config.anatomy.labels) {
    loader.load(*config.anatomy.labels, read_volume, inputs.labels);
    std::optional<LabelNames> names;
    loader.load(*config.anatomy.labels, label_names_beside, names);
    if (names) inputs.label_names = std::move(*names);
  }
  return {std::move(inputs), loader.status()};
}

}  // namespace

// Only these need an escape in printable text; control characters by number.
std::string yaml_text(const std::string& value) {
  std::string out = "\"";
  for (const char c : value) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\x{:02x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out + "\"";
}

Result<CaseConfig> parse_case_config(const std::string& text, const fs::path& file) {
  return parse_case(text, file, false);
}

Result<CaseConfig> read_case_config(const fs::path& path) {
  return read_file(path).and_then(
      [&](const std::string& text) { return parse_case(text, path, true); });
}

std::string case_config_text(const CaseConfig& config) {
  KeyWriter writer(config.anatomy.labels.has_value());
  visit(writer, config);
  return writer.text();
}

Result<CaseInputs> load_case_inputs(const CaseConfig& config) {
  ReadableInputs read = load(config, false);
  if (!read.status) return tl::unexpected(read.status.error());
  return std::move(read.inputs);
}

ReadableInputs load_readable_inputs(const CaseConfig& config) { return load(config, true); }

}  // namespace brainshift::io
