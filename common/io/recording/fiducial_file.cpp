// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/fiducial_file.hpp"

#include <string>
#include <vector>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/landmarks/point_file.hpp"

namespace brainshift::io {
namespace {

struct Rows {
  std::vector<Vec3> reference, ras;
  bool paired = false, single = false;
};

bool parse_point(const std::vector<std::string_view>& cells, std::size_t first, Vec3& point) {
  return parse_number(cells[first], point[0]) && parse_number(cells[first + 1], point[1]) &&
         parse_number(cells[first + 2], point[2]);
}

bool take_row(const std::vector<std::string_view>& cells, Rows& rows) {
  Vec3 first, second;
  if (cells.size() == 6 && parse_point(cells, 0, first) && parse_point(cells, 3, second)) {
    rows.reference.push_back(first);
    rows.ras.push_back(second);
    rows.paired = true;
    return true;
  }
  if (cells.size() != 4 || !parse_point(cells, 1, first)) return false;
  if (cells[0] != "reference" && cells[0] != "ras") return false;
  (cells[0] == "ras" ? rows.ras : rows.reference).push_back(first);
  rows.single = true;
  return true;
}

}  // namespace

Result<FiducialFile> read_fiducials(const std::filesystem::path& path) {
  return parse_file(path, [](const std::string& content) -> Result<FiducialFile> {
    Rows rows;
    bool heading_allowed = true;
    for (const auto& [line, text] : content_lines(content)) {
      const std::string_view row = trimmed(std::string_view(text).substr(0, text.find('#')));
      const bool taken = take_row(cells_of(row), rows);
      double number = 0.0;
      const bool heading = heading_allowed && !taken && !parse_number(cells_of(row).back(), number);
      heading_allowed = false;
      if (heading) continue;
      if (!taken || (rows.paired && rows.single)) {
        return bad_line(line, row,
                        "must be 6 numbers (reference x, y, z, RAS x, y, z), or reference,x,y,z "
                        "and ras,x,y,z in every row");
      }
    }
    const Points reference = columns_of(rows.reference), ras = columns_of(rows.ras);
    auto fit = rows.single ? registration::match_fiducials(reference, ras)
                           : registration::register_fiducials(reference, ras);
    if (!fit) return tl::unexpected(fit.error());
    return FiducialFile{std::move(*fit), rows.single};
  });
}

}  // namespace brainshift::io
