// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/stl_file.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

#include "common/io/files/binary_codec.hpp"
#include "common/io/files/point_space.hpp"

namespace brainshift::io {
namespace {

constexpr std::size_t kHeader = 84;     // 80 bytes of text, 4 of count
constexpr std::size_t kFacetText = 50;  // normal, three corners (floats), 2 bytes of attributes

// Merges corners whose coordinates are equal bit for bit (after making -0 into 0): programs write
// a shared vertex with the same digits each time.
class SurfaceBuilder {
 public:
  void add_corner(double x, double y, double z) {
    const std::array<double, 3> key = {x + 0.0, y + 0.0, z + 0.0};
    const auto [entry, is_new] = index_.emplace(key, static_cast<int>(index_.size()));
    if (is_new) coordinates_.insert(coordinates_.end(), key.begin(), key.end());
    corners_.push_back(entry->second);
  }
  std::size_t corners() const { return corners_.size(); }
  TriangleSurface surface() const {
    TriangleSurface result;
    result.vertices = Eigen::Map<const Points>(coordinates_.data(), 3,
                                               static_cast<Eigen::Index>(coordinates_.size() / 3));
    result.triangles = Eigen::Map<const Eigen::Matrix<int, 3, Eigen::Dynamic>>(
        corners_.data(), 3, static_cast<Eigen::Index>(corners_.size() / 3));
    return result;
  }

 private:
  std::map<std::array<double, 3>, int> index_;
  std::vector<double> coordinates_;
  std::vector<int> corners_;
};

Result<TriangleSurface> parse_binary(const std::string& content, std::size_t triangles) {
  SurfaceBuilder builder;
  for (std::size_t t = 0; t < triangles; ++t) {
    const char* at = content.data() + kHeader + t * kFacetText + 12;
    for (int corner = 0; corner < 3; ++corner, at += 12) {
      const float x = load_number<float>(at, false);
      const float y = load_number<float>(at + 4, false);
      const float z = load_number<float>(at + 8, false);
      // NaN would break the order of the merging map.
      if (!(std::isfinite(x) && std::isfinite(y) && std::isfinite(z))) {
        return fail(ErrorCode::kUnreadable,
                    "triangle " + std::to_string(t) + " has a coordinate that is not finite");
      }
      builder.add_corner(x, y, z);
    }
  }
  return builder.surface();
}

std::string_view next_word(std::string_view& text) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string_view::npos) {
    text = {};
    return {};
  }
  const std::size_t end = std::min(text.find_first_of(kSpace, begin), text.size());
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

bool parse_real(std::string_view word, double& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && stop == word.data() + word.size() && std::isfinite(value);
}

Result<TriangleSurface> parse_ascii(std::string_view text) {
  SurfaceBuilder builder;
  std::size_t loops = 0;
  bool ended = false;
  for (std::string_view word = next_word(text); !word.empty(); word = next_word(text)) {
    if (word == "endsolid") ended = true;
    if (word == "endloop" && builder.corners() != 3 * ++loops) {
      return fail(ErrorCode::kUnreadable,
                  "facet " + std::to_string(loops - 1) + " does not have three vertices");
    }
    if (word != "vertex") continue;
    double p[3];
    for (double& coordinate : p) {
      const std::string_view number = next_word(text);
      if (!parse_real(number, coordinate)) {
        return fail(ErrorCode::kUnreadable, "vertex coordinate '" + std::string(number) +
                                                "' of facet " + std::to_string(loops) +
                                                " is not a finite number");
      }
    }
    builder.add_corner(p[0], p[1], p[2]);
  }
  if (!ended || builder.corners() != 3 * loops) {
    return fail(ErrorCode::kUnreadable, "ends before endsolid");
  }
  return builder.surface();
}

Result<TriangleSurface> as_ras(Result<TriangleSurface> surface, std::string_view heading) {
  if (!surface) return surface;
  const Result<PointSpace> space = point_space_in(heading.substr(0, heading.find('\0')));
  if (!space) return tl::unexpected(space.error());
  turn_to_ras(*space, surface->vertices);
  return surface;
}

}  // namespace

Result<TriangleSurface> parse_stl(const std::string& content) {
  const std::string_view text(content);
  // A binary file may begin with "solid" too, so the size decides.
  if (content.size() >= kHeader) {
    const std::size_t triangles = load_number<std::uint32_t>(content.data() + 80, false);
    if (content.size() == kHeader + triangles * kFacetText) {
      return as_ras(parse_binary(content, triangles), text.substr(0, 80));
    }
  }
  if (content.rfind("solid", 0) == 0) {
    return as_ras(parse_ascii(content), text.substr(0, text.find('\n')));
  }
  return fail(ErrorCode::kUnreadable,
              "is neither an ASCII STL nor a binary one of the promised size");
}

}  // namespace brainshift::io
