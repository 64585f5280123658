// SPDX-License-Identifier: GPL-3.0-or-later
// Charts with a column per kind of surgery and a dot per surgery.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "client/tools/pictures/chart.hpp"
#include "common/core/error.hpp"
#include "tests/surgeries/surgery_table.hpp"

namespace brainshift::surgeries {

// The ends of a column's dots, measured from its middle. A column is 1 wide.
struct Strip {
  double left = 0.0, right = 0.0;
};

// A row of a table -> what is drawn.
using RowValue = std::function<double(const Rows&, std::size_t)>;

// Dots of the rows in column `column`, evenly from left to right in the order of the rows.
void add_dots(client::Series& series, const Rows& rows, std::size_t column, Strip strip,
              const RowValue& value);

// A dashed line at `bound` across all columns.
client::Series bound_line(double bound, std::size_t columns, const std::string& legend);

// kWriteFailed.
Status write_chart(const client::ChartSpec& spec, const std::filesystem::path& file);

}  // namespace brainshift::surgeries
