// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/sensing/answer_volume.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "common/io/files/file_access.hpp"
#include "common/io/files/packed_values.hpp"
#include "common/io/recording/sequence_header.hpp"

namespace brainshift::test_support {
namespace {

Vec3 three_numbers(const io::SequenceHeader& header, const char* key) {
  Vec3 value = Vec3::Zero();
  const std::string& text = header.fields.at(key);
  char* rest = nullptr;
  const char* at = text.c_str();
  for (int axis = 0; axis < 3; ++axis, at = rest) value[axis] = std::strtod(at, &rest);
  return value;
}

}  // namespace

Result<AnswerVolume> read_answer(const std::filesystem::path& path) {
  const auto content = io::read_file(path);
  if (!content) return tl::unexpected(content.error());
  const auto header = io::parse_meta_sequence(*content);
  if (!header) return io::file_error(header.error().code, path, header.error().message);
  const auto bytes = io::unpack(*header, 1);
  if (!bytes) return io::file_error(bytes.error().code, path, bytes.error().message);
  AnswerVolume volume;
  volume.grid.origin_mm = three_numbers(*header, "Offset");
  volume.grid.spacing_mm = three_numbers(*header, "ElementSpacing");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    volume.grid.dims[axis] = static_cast<int>(header->sizes[axis]);
  }
  for (const char byte : *bytes) {
    volume.values.push_back(static_cast<float>(static_cast<unsigned char>(byte)));
  }
  return volume;
}

Agreement compare(const CompoundedVolume& ours, const AnswerVolume& answer,
                  const std::array<int, 3>& shift, Voxels voxels) {
  const std::array<int, 3>& dims = answer.grid.dims;
  double n = 0, sx = 0, sy = 0, sxx = 0, syy = 0, sxy = 0, difference = 0, bright = 0;
  for (std::size_t i = 0; i < answer.values.size(); ++i) {
    if (voxels == Voxels::kWeFilled && ours.weight[i] <= 0.0F) continue;
    const int at = static_cast<int>(i);
    const std::array<int, 3> moved{at % dims[0] + shift[0], at / dims[0] % dims[1] + shift[1],
                                   at / dims[0] / dims[1] + shift[2]};
    bool inside = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      inside = inside && moved[axis] >= 0 && moved[axis] < dims[axis];
    }
    if (!inside) continue;
    const double x = ours.image.values[i];
    const double y =
        answer
            .values[static_cast<std::size_t>(moved[0] + dims[0] * (moved[1] + dims[1] * moved[2]))];
    if (voxels == Voxels::kPlusFilled && y <= 0.0) continue;
    n += 1, sx += x, sy += y, sxx += x * x, syy += y * y, sxy += x * y;
    if (y > 0.0) difference += std::abs(x - y), bright += 1;
  }
  Agreement result;
  const double vx = sxx / n - sx * sx / n / n, vy = syy / n - sy * sy / n / n;
  result.correlation = (sxy / n - sx * sy / n / n) / std::sqrt(std::max(1e-300, vx * vy));
  result.mean_difference = difference / std::max(1.0, bright);
  result.voxels = std::lround(n);
  return result;
}

}  // namespace brainshift::test_support
