// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/plus_config.hpp"
#include "common/core/rigid_motion.hpp"

#include <fmt/format.h>

#include <optional>
#include <pugixml.hpp>
#include <sstream>
#include <string>
#include <utility>

#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

// Exactly 16 numbers, row by row, and nothing else.
std::optional<Eigen::Matrix4d> parse_matrix(const char* text) {
  std::istringstream in(text);
  Eigen::Matrix4d matrix;
  for (int i = 0; i < 16; ++i) {
    if (!(in >> matrix(i / 4, i % 4))) return std::nullopt;
  }
  std::string more;
  if (in >> more) return std::nullopt;
  return matrix;
}

Result<tracking::ConstantLink> read_transform(const pugi::xml_node& node) {
  tracking::ConstantLink link;
  tracking::FramePair& frames = link.frames;
  frames.from = node.attribute("From").value();
  frames.to = node.attribute("To").value();
  if (frames.from.empty() || frames.to.empty()) return unreadable("a Transform without From or To");
  const std::string name = "Transform " + frames.name();
  const auto matrix = parse_matrix(node.attribute("Matrix").value());
  if (!matrix) return unreadable(name + ": Matrix is not 16 numbers");
  const bool scales = tracking::is_image_frame(frames.from) || tracking::is_image_frame(frames.to);
  const Status usable = scales ? check_affine(*matrix) : check_rigid(*matrix);
  if (!usable) return unreadable(name + ": Matrix " + usable.error().message);
  if (scales) {
    link.T_to_from.matrix() = *matrix;
  } else {
    link.T_to_from = nearest_rigid(*matrix);
  }
  return link;
}

}  // namespace

Result<std::vector<tracking::ConstantLink>> read_plus_config(const std::filesystem::path& path) {
  using Links = std::vector<tracking::ConstantLink>;
  return parse_file(path, [](const std::string& content) -> Result<Links> {
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer(content.data(), content.size());
    if (!parsed) {
      return unreadable(
          fmt::format("is no XML: {} at byte {}", parsed.description(), parsed.offset));
    }
    const pugi::xml_node root = document.child("PlusConfiguration");
    if (!root) return unreadable("has no element PlusConfiguration");
    Links links;
    for (const pugi::xml_node& node : root.child("CoordinateDefinitions").children("Transform")) {
      auto transform = read_transform(node);
      if (!transform) return tl::unexpected(transform.error());
      links.push_back(std::move(*transform));
    }
    return links;
  });
}

}  // namespace brainshift::io
