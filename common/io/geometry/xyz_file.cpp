// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/xyz_file.hpp"

#include <algorithm>

#include "common/io/files/number_text.hpp"

namespace brainshift::io {
namespace {

// Without a first line of words, as spreadsheets and scanners put it.
std::string without_heading(const std::string& content) {
  const std::size_t first = content.find_first_not_of(" \t\r\n");
  const bool letter = first != std::string::npos && ((content[first] | 0x20) >= 'a') &&
                      ((content[first] | 0x20) <= 'z');
  if (!letter || content.compare(first, 3, "nan") == 0 || content.compare(first, 3, "inf") == 0)
    return content;
  std::string commented = "#";
  return commented.append(content, first);
}

}  // namespace

Result<TriangleSurface> parse_xyz(const std::string& content) {
  const auto rows = parse_number_rows(without_heading(content));
  if (!rows) return tl::unexpected(rows.error());
  TriangleSurface surface;
  surface.vertices.resize(3, static_cast<Eigen::Index>(rows->size()));
  for (std::size_t i = 0; i < rows->size(); ++i) {
    const std::vector<double>& row = (*rows)[i];
    if (row.size() < 3) {
      return fail(ErrorCode::kUnreadable, "point " + std::to_string(i) + " has " +
                                              std::to_string(row.size()) +
                                              " coordinates: must have 3");
    }
    surface.vertices.col(static_cast<Eigen::Index>(i)) << row[0], row[1], row[2];
  }
  return surface;
}

}  // namespace brainshift::io
