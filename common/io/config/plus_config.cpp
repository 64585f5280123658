// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/plus_config.hpp"
#include "common/core/rigid_motion.hpp"

#include <fmt/format.h>

#include <pugixml.hpp>
#include <sstream>

#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

// Exactly N numbers and nothing else.
template <int N>
std::optional<std::array<double, N>> parse_numbers(const char* text) {
  std::istringstream in(text);
  std::array<double, N> numbers{};
  for (double& number : numbers) {
    if (!(in >> number)) return std::nullopt;
  }
  std::string more;
  if (in >> more) return std::nullopt;
  return numbers;
}

Result<tracking::ConstantLink> read_transform(const pugi::xml_node& node) {
  tracking::ConstantLink link;
  tracking::FramePair& frames = link.frames;
  frames.from = node.attribute("From").value();
  frames.to = node.attribute("To").value();
  if (frames.from.empty() || frames.to.empty()) return unreadable("a Transform without From or To");
  const std::string name = "Transform " + frames.name();
  const auto numbers = parse_numbers<16>(node.attribute("Matrix").value());
  if (!numbers) return unreadable(name + ": Matrix is not 16 numbers");
  const Eigen::Matrix4d matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers->data());
  const bool scales = tracking::is_image_frame(frames.from) || tracking::is_image_frame(frames.to);
  const Status usable = scales ? check_affine(matrix) : check_rigid(matrix);
  if (!usable) return unreadable(name + ": Matrix " + usable.error().message);
  if (scales) {
    link.T_to_from.matrix() = matrix;
  } else {
    link.T_to_from = nearest_rigid(matrix);
  }
  return link;
}

Status read_reconstruction(const pugi::xml_node& node, PlusConfig& config) {
  const char* origin_text = node.attribute("ClipRectangleOrigin").value();
  const char* size_text = node.attribute("ClipRectangleSize").value();
  if (*origin_text != '\0' || *size_text != '\0') {
    const auto origin = parse_numbers<2>(origin_text);
    const auto size = parse_numbers<2>(size_text);
    const auto pixels = [](double value) { return value >= 0.0 && value <= 1e5; };
    if (!origin || !size || !pixels((*origin)[0]) || !pixels((*origin)[1]) || !pixels((*size)[0]) ||
        !pixels((*size)[1])) {
      return unreadable(
          fmt::format("ClipRectangleOrigin = \"{}\", ClipRectangleSize = \"{}\": must be two "
                      "numbers of pixels each",
                      origin_text, size_text));
    }
    config.clip = ClipRectangle{{static_cast<int>((*origin)[0]), static_cast<int>((*origin)[1])},
                                {static_cast<int>((*size)[0]), static_cast<int>((*size)[1])}};
  }
  const char* spacing_text = node.attribute("OutputSpacing").value();
  if (*spacing_text == '\0') return {};
  const auto spacing = parse_numbers<3>(spacing_text);
  if (!spacing || !((*spacing)[0] > 0.0 && (*spacing)[1] > 0.0 && (*spacing)[2] > 0.0)) {
    return unreadable(
        fmt::format("OutputSpacing = \"{}\": must be three lengths in mm", spacing_text));
  }
  config.output_spacing_mm = Vec3((*spacing)[0], (*spacing)[1], (*spacing)[2]);
  return {};
}

}  // namespace

Result<PlusConfig> read_plus_config(const std::filesystem::path& path) {
  return parse_file(path, [](const std::string& content) -> Result<PlusConfig> {
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer(content.data(), content.size());
    if (!parsed) {
      return unreadable(
          fmt::format("is no XML: {} at byte {}", parsed.description(), parsed.offset));
    }
    const pugi::xml_node root = document.child("PlusConfiguration");
    if (!root) return unreadable("has no element PlusConfiguration");
    PlusConfig config;
    for (const pugi::xml_node& node : root.child("CoordinateDefinitions").children("Transform")) {
      auto transform = read_transform(node);
      if (!transform) return tl::unexpected(transform.error());
      config.transforms.push_back(std::move(*transform));
    }
    const Status ok = read_reconstruction(root.child("VolumeReconstruction"), config);
    if (!ok) return tl::unexpected(ok.error());
    return config;
  });
}

}  // namespace brainshift::io
