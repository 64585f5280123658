// SPDX-License-Identifier: GPL-3.0-or-later
// Tables in text files: rows of cells, and which of their columns hold what.
//
// A first row without a number is a heading. So is a line behind # in front of the rows that has
// as many cells as they, each of them one word (numpy writes such headings). A reader obeys a
// heading or refuses it; it never falls back to the order of the columns.
//
// A heading's cell is split into words at everything that is neither a letter nor a digit; case
// does not count: "X (mm)" is {x, mm}, "x_before" is {x, before}.
#pragma once

#include <array>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

using Cells = std::vector<std::string>;

// Columns of a place, and what takes it to RAS.
struct PlaceColumns {
  std::array<std::size_t, 3> at{};
  Vec3 signs = Vec3(1, 1, 1);

  // None: a cell is missing or no finite number.
  std::optional<Vec3> of(const Cells& row) const;
};

class Heading {
 public:
  using Words = std::set<std::string>;

  explicit Heading(const Cells& cells);

  // The only column with exactly one word of `names` and all others of `also`. None: there is no
  // such column, or more than one.
  std::optional<std::size_t> column(const Words& names, const Words& also = {}) const;
  // The column called label, name or row.
  std::optional<std::size_t> name_column() const;
  // The three columns of a place: x, y, z or r, a, s or l, p, s, each with a word of `sides` (none
  // where that is empty) and perhaps mm, ras or lps. l, p, s and lps are turned to RAS. None
  // unless exactly one such triple is there. axes: which of the three triples count.
  std::optional<PlaceColumns> place(const Words& sides = {},
                                    const Words& axes = {"xyz", "ras", "lps"}) const;
  // Whether a row holds places that somebody has placed: every column with the word "defined" says
  // 1 or true. kUnreadable for a word that means neither.
  Result<bool> placed(const Cells& row) const;
  std::size_t size() const { return words_.size(); }

 private:
  std::vector<Words> words_;  // of each column
};

struct TableRow {
  int line = 0;      // from 1
  std::string text;  // of the whole row
  Cells cells;
};
struct Table {
  std::optional<Heading> heading;
  TableRow heading_row;
  std::vector<TableRow> rows;
};

// Cells between commas, perhaps in quotation marks. Lines that are empty or begin with # are
// skipped. comments_behind: so is what follows a # in a row.
Table parse_table(const std::string& content, bool comments_behind = false);

}  // namespace brainshift::io
