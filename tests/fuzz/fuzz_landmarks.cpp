// SPDX-License-Identifier: GPL-3.0-or-later
// Named points and pairs of them: Slicer's markups, MNI tag files, tables.
#include "common/io/landmarks/pair_file.hpp"
#include "common/io/landmarks/point_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/fuzz/scratch_file.hpp"

namespace brainshift::fuzz {
namespace {

void require_finite(const std::vector<Vec3>& points, std::size_t count) {
  require(points.size() == count, "every name has a point");
  require(columns_of(points).allFinite(), "every point lies somewhere");
}

}  // namespace

void run(std::string_view bytes) {
  for (const char* name : {"points.mrk.json", "points.fcsv", "points.csv"}) {
    const auto points = io::read_points(scratch_file(name, bytes));
    if (points) require_finite(points->points, points->names.size());
  }
  for (const char* name : {"pairs.csv", "pairs.tag"}) {
    const auto pairs = io::read_pairs(scratch_file(name, bytes));
    if (!pairs) continue;
    require_finite(pairs->first, pairs->names.size());
    require_finite(pairs->second, pairs->names.size());
  }
}

}  // namespace brainshift::fuzz
