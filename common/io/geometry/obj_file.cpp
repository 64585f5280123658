// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/obj_file.hpp"

#include <limits>
#include <sstream>
#include <vector>

#include "common/io/files/point_space.hpp"

namespace brainshift::io {
namespace {

tl::unexpected<Error> at_line(int line, const std::string& message) {
  return fail(ErrorCode::kUnreadable, "line " + std::to_string(line) + ": " + message);
}

// "7/1/3" -> 7
bool parse_vertex_number(const std::string& word, long long& number) {
  std::istringstream in(word.substr(0, word.find('/')));
  return static_cast<bool>(in >> number) && in.peek() == std::istringstream::traits_type::eof();
}

}  // namespace

Result<TriangleSurface> parse_obj(const std::string& content) {
  std::istringstream lines(content);
  std::vector<double> coordinates;
  std::vector<int> corners;
  PointSpace space = PointSpace::kUnsaid;
  std::string text;
  for (int line = 1; std::getline(lines, text); ++line) {
    std::istringstream words(text);
    std::string first;
    words >> first;
    if (!first.empty() && first.front() == '#' && space == PointSpace::kUnsaid) {
      const Result<PointSpace> said = point_space_in(text);
      if (!said) return at_line(line, said.error().message);
      space = *said;
    } else if (first == "v") {
      double x = 0.0;
      double y = 0.0;
      double z = 0.0;
      if (!(words >> x >> y >> z)) return at_line(line, "vertex without three coordinates");
      coordinates.insert(coordinates.end(), {x, y, z});
    } else if (first == "f") {
      const auto known = static_cast<long long>(coordinates.size() / 3);
      std::string word;
      int count = 0;
      while (words >> word) {
        long long number = 0;
        if (!parse_vertex_number(word, number)) return at_line(line, "'" + word + "' is no vertex");
        const long long index = number < 0 ? known + number : number - 1;
        const bool fits = number != 0 && index >= 0 && index <= std::numeric_limits<int>::max();
        if (!fits) return at_line(line, "vertex " + word + " does not exist");
        corners.push_back(static_cast<int>(index));
        ++count;
      }
      if (count != 3) {
        return at_line(line, "face has " + std::to_string(count) + " vertices: must have 3");
      }
    }
  }
  TriangleSurface surface;
  surface.vertices = Eigen::Map<const Points>(coordinates.data(), 3,
                                              static_cast<Eigen::Index>(coordinates.size() / 3));
  turn_to_ras(space, surface.vertices);
  surface.triangles = Eigen::Map<const Eigen::Matrix<int, 3, Eigen::Dynamic>>(
      corners.data(), 3, static_cast<Eigen::Index>(corners.size() / 3));
  return surface;
}

}  // namespace brainshift::io
