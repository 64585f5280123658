// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/pose_file.hpp"

#include <vector>

#include "common/values/stereo_calibration.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/number_text.hpp"
#include "common/io/files/yaml_section.hpp"

namespace brainshift::io {
namespace {

constexpr std::size_t kNumbers = 16;

Result<std::vector<double>> yaml_numbers(const std::string& text, const std::filesystem::path& path,
                                         const std::string& name) {
  YamlDocument document = YamlDocument::parse(text, path);
  YamlSection root = document.root();
  std::vector<double> numbers;
  root.numbers(name, numbers, Presence::kRequired);
  root.done();
  if (Status ok = document.status(); !ok) return tl::unexpected(ok.error());
  return numbers;
}

}  // namespace

Result<RigidTransform> read_pose(const std::filesystem::path& path, const std::string& name) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  const std::string extension = path.extension().string();
  std::vector<double> numbers;
  if (extension == ".yaml" || extension == ".yml") {
    auto read = yaml_numbers(*text, path, name);
    if (!read) return tl::unexpected(read.error());
    numbers = std::move(*read);
  } else {
    auto rows = parse_number_rows(*text);
    if (!rows) return file_error(rows.error().code, path, rows.error().message);
    for (const std::vector<double>& row : *rows)
      numbers.insert(numbers.end(), row.begin(), row.end());
  }
  if (numbers.size() != kNumbers) {
    return file_error(ErrorCode::kUnreadable, path,
                      name + " has " + std::to_string(numbers.size()) +
                          " numbers: must have sixteen, a 4 x 4 matrix row by row");
  }
  Eigen::Matrix4d matrix;
  for (int i = 0; i < 16; ++i) matrix(i / 4, i % 4) = numbers[static_cast<std::size_t>(i)];
  if (Status ok = check_rigid(name, matrix); !ok)
    return file_error(ok.error().code, path, ok.error().message);
  return nearest_rigid(matrix);
}

}  // namespace brainshift::io
