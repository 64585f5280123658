// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/fiducial_file.hpp"

#include <optional>
#include <string>
#include <vector>

#include "common/core/mesh.hpp"
#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/table.hpp"

namespace brainshift::io {
namespace {

struct FiducialRows {
  std::vector<Vec3> reference, ras;
  bool paired = false, single = false;
};

// Of pairs: both places. Of single points: `list` and the one place.
struct FiducialColumns {
  std::optional<std::size_t> list;
  PlaceColumns reference{{0, 1, 2}}, ras{{3, 4, 5}};
};

// None: the heading names neither two places nor a list and a place.
std::optional<FiducialColumns> fiducial_columns(const Heading& heading) {
  FiducialColumns columns;
  auto reference = heading.place({"reference", "ref", "touched", "tracker", "measured"});
  auto ras = heading.place({"ras", "lps", "image", "mri", "ct"});
  const auto list = heading.column({"list", "set", "frame", "space", "kind"});
  if (!ras && !list) ras = heading.place({}, {"ras", "lps"});
  if (!reference) reference = heading.place({}, {"xyz"});
  if (!reference || !(ras || list) || reference->signs != Vec3::Ones()) return std::nullopt;
  columns.reference = *reference;
  if (ras) {
    columns.ras = *ras;
  } else {
    columns.list = list, columns.ras = *reference;
  }
  return columns;
}

bool take_row(const Cells& cells, const FiducialColumns& columns, FiducialRows& rows) {
  const auto reference = columns.reference.of(cells), ras = columns.ras.of(cells);
  if (!columns.list) {
    if (!reference || !ras) return false;
    rows.reference.push_back(*reference), rows.ras.push_back(*ras);
    return rows.paired = true;
  }
  const std::string list = *columns.list < cells.size() ? lower_case(cells[*columns.list]) : "";
  if (!ras || (list != "reference" && list != "ras")) return false;
  (list == "ras" ? rows.ras : rows.reference).push_back(*ras);
  return rows.single = true;
}

}  // namespace

Result<FiducialFile> read_fiducials(const std::filesystem::path& path) {
  return parse_file(path, [](const std::string& content) -> Result<FiducialFile> {
    const Table table = parse_table(content, true);
    std::optional<FiducialColumns> columns = FiducialColumns{};
    if (table.heading) columns = fiducial_columns(*table.heading);
    if (!columns) {
      return bad_line(table.heading_row.line, table.heading_row.text,
                      "must name the columns x_ref, y_ref, z_ref and x_ras, y_ras, z_ras, each "
                      "once, or list, x, y, z");
    }
    FiducialRows rows;
    for (const TableRow& row : table.rows) {
      const auto placed = table.heading ? table.heading->placed(row.cells) : Result<bool>(true);
      if (!placed) return bad_line(row.line, row.text, placed.error().message);
      if (!*placed) continue;
      if (!table.heading && row.cells.size() == 4) {
        columns->list = 0, columns->ras = {{1, 2, 3}};
      } else if (!table.heading) {
        columns = FiducialColumns{};
      }
      const std::size_t size = table.heading ? table.heading->size() : columns->list ? 4 : 6;
      const bool taken = row.cells.size() == size && take_row(row.cells, *columns, rows);
      if (!taken || (rows.paired && rows.single)) {
        return bad_line(row.line, row.text,
                        "must be 6 numbers (reference x, y, z, RAS x, y, z), or reference,x,y,z "
                        "and ras,x,y,z in every row");
      }
    }
    const Points reference = columns_of(rows.reference), ras = columns_of(rows.ras);
    auto fit = rows.single ? registration::match_fiducials(reference, ras)
                           : registration::register_fiducials(reference, ras);
    if (!fit) return tl::unexpected(fit.error());
    if (Status head = registration::check_head_fit(reference, *fit); !head) {
      return tl::unexpected(head.error());
    }
    return FiducialFile{std::move(*fit), rows.single};
  });
}

}  // namespace brainshift::io
