// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/recording/registration_file.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <vector>

#include "common/io/files/file_access.hpp"
#include "common/tracking/recording.hpp"

namespace brainshift::io {
namespace {

constexpr std::string_view kKey = "T_ras_reference";
constexpr std::string_view kSeparators = " \t\r\n,[]{}\"':-";

// The text behind the key, if the file begins with it.
std::string_view numbers_part(std::string_view text) {
  const std::size_t key = text.find(kKey);
  if (key == std::string_view::npos) return text;
  const bool leads = text.substr(0, key).find_first_not_of(kSeparators) == std::string_view::npos;
  return leads ? text.substr(key + kKey.size()) : text;
}

bool is_sign_of_number(std::string_view text) {
  return text.size() > 1 && text[0] == '-' &&
         ((text[1] >= '0' && text[1] <= '9') || text[1] == '.' || text[1] == 'i' || text[1] == 'n');
}

}  // namespace

Result<RigidTransform> read_registration(const std::filesystem::path& path) {
  const auto content = io::read_file(path);
  if (!content) return tl::unexpected(content.error());
  std::string_view rest = numbers_part(*content);
  std::vector<double> numbers;
  while (!rest.empty()) {
    if (!is_sign_of_number(rest) && kSeparators.find(rest.front()) != std::string_view::npos) {
      rest.remove_prefix(1);
      continue;
    }
    double number = 0.0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    if (error != std::errc()) {
      const std::size_t word = std::min(rest.find_first_of(" \t\r\n,"), std::size_t{30});
      return io::file_error(ErrorCode::kUnreadable, path,
                            fmt::format("\"{}\" is no number of a 4 x 4 matrix T_ras_reference",
                                        rest.substr(0, word)));
    }
    numbers.push_back(number);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  }
  if (numbers.size() != 16) {
    return io::file_error(ErrorCode::kUnreadable, path,
                          fmt::format("holds {} numbers: T_ras_reference has 16", numbers.size()));
  }
  const Eigen::Matrix4d matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
  if (Status rigid = tracking::check_rigid(matrix); !rigid) {
    return io::file_error(ErrorCode::kUnreadable, path, "T_ras_reference " + rigid.error().message);
  }
  return tracking::nearest_rigid(matrix);
}

}  // namespace brainshift::io
