// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/config_file.hpp"

#include <cmath>

#include "common/configuration/case_keys.hpp"
#include "common/io/config/key_reader.hpp"
#include "common/io/config/key_writer.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

// Length 1. A direction that has it already keeps its bits, so that a stored case reads back
// unchanged.
Vec3 unit(const Vec3& direction) {
  const double length = direction.norm();
  return std::abs(length - 1.0) < 1e-15 ? direction : direction / length;
}

}  // namespace

Result<CaseConfig> parse_case_config(const std::string& text, const fs::path& file) {
  YamlDocument document = YamlDocument::parse(text, file);
  YamlSection root = document.root();
  CaseConfig config;
  config.file = fs::absolute(file).lexically_normal();
  KeyReader reader(root);
  visit(reader, config);
  root.done();
  if (Status status = document.status(); !status) return tl::unexpected(status.error());
  if (Status status = brainshift::validate(config); !status) {
    return tl::unexpected(document.locate(status.error()));
  }
  config.gravity_direction = unit(config.gravity_direction);
  config.craniotomy.long_axis_direction = unit(config.craniotomy.long_axis_direction);
  return config;
}

Result<CaseConfig> read_case_config(const fs::path& path) {
  const Result<std::string> text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  return parse_case_config(*text, path);
}

std::string case_config_text(const CaseConfig& config) {
  KeyWriter writer;
  visit(writer, config);
  return writer.text();
}

}  // namespace brainshift::io
