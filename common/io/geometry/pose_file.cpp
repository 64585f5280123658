// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/pose_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>

#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

// What may stand between numbers in text, JSON and YAML; "-" begins an entry of a YAML list.
constexpr std::string_view kSeparators = " \t\r\n,;[]{}\"':-";

// A '-' or '+' that belongs to a number; "-nan" and "-inf" are refused later, by their own names.
bool is_sign_of_number(std::string_view text) {
  return text.size() > 1 && text[0] == '-' &&
         ((text[1] >= '0' && text[1] <= '9') || text[1] == '.' || text[1] == 'i' || text[1] == 'n');
}

void skip_separators(std::string_view& rest) {
  while (!rest.empty()) {
    const bool separator =
        !is_sign_of_number(rest) && kSeparators.find(rest.front()) != std::string_view::npos;
    if (!separator) return;
    rest.remove_prefix(1);
  }
}

// The numbers of a text without comments; kUnreadable for anything else in it.
Result<std::vector<double>> pose_numbers(std::string_view rest, const std::string& name) {
  skip_separators(rest);
  if (rest.rfind(name, 0) == 0) rest.remove_prefix(name.size());
  std::vector<double> numbers;
  for (skip_separators(rest); !rest.empty(); skip_separators(rest)) {
    const std::size_t end = std::min(rest.find_first_of(" \t\r\n,;[]{}"), rest.size());
    std::string_view word = rest.substr(0, end);
    if (word.size() > 1 && word.front() == '+' && word[1] != '-') word.remove_prefix(1);
    double number = 0.0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || stop != word.data() + word.size()) {
      return unreadable(
          fmt::format("\"{}\" is no number of a 4 x 4 matrix {}", word.substr(0, 30), name));
    }
    numbers.push_back(number);
    rest.remove_prefix(end);
  }
  return numbers;
}

std::string without_comments(std::string_view text) {
  std::string kept;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
    const std::string_view line = text.substr(0, end);
    const std::size_t first = line.find_first_not_of(" \t");
    if (first == std::string_view::npos || line[first] != '#') kept += line;
    text.remove_prefix(end);
  }
  return kept;
}

}  // namespace

Result<RigidTransform> read_pose(const std::filesystem::path& path, const std::string& name,
                                 double tolerance) {
  return parse_file(path, [&](const std::string& content) -> Result<RigidTransform> {
    const auto numbers = pose_numbers(without_comments(content), name);
    if (!numbers) return tl::unexpected(numbers.error());
    if (numbers->size() != 16) {
      return unreadable(fmt::format("{} has {} numbers: must have 16, a 4 x 4 matrix row by row",
                                    name, numbers->size()));
    }
    const Eigen::Matrix4d matrix =
        Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers->data());
    if (Status rigid = check_rigid(matrix, tolerance); !rigid) {
      return unreadable(name + " " + rigid.error().message);
    }
    return nearest_rigid(matrix);
  });
}

Status write_pose(const std::filesystem::path& path, const std::string& name,
                  const RigidTransform& T, const std::vector<std::string>& comments) {
  std::string text;
  for (const std::string& comment : comments) text += "# " + comment + "\n";
  text += name + ":\n";
  for (int row = 0; row < 4; ++row) {
    const auto numbers = T.matrix().row(row);
    text += fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}\n", numbers[0], numbers[1], numbers[2],
                        numbers[3]);
  }
  return write_file(path, text);
}

}  // namespace brainshift::io
