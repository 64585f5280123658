// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/landmarks/named_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace brainshift::io {
namespace {

using Index = std::map<std::string, std::size_t>;

Result<Index> index_of(const NamedPoints& list, const char* what) {
  Index index;
  for (std::size_t i = 0; i < list.names.size(); ++i) {
    if (list.names[i].empty()) {
      return fail(ErrorCode::kInvalidArgument,
                  fmt::format("point {} of the {} list has no name", i + 1, what));
    }
    if (!index.emplace(list.names[i], i).second) {
      return fail(ErrorCode::kInvalidArgument,
                  fmt::format("the {} list has two points called \"{}\"", what, list.names[i]));
    }
  }
  return index;
}

}  // namespace

void NamedPoints::add(std::string name, const Vec3& point) {
  names.push_back(std::move(name));
  points.push_back(point);
}

bool NamedPoints::all_named() const {
  return std::none_of(names.begin(), names.end(), [](const auto& name) { return name.empty(); });
}

void NamedPairs::add(std::string name, const Vec3& one, const Vec3& other) {
  names.push_back(std::move(name));
  first.push_back(one);
  second.push_back(other);
}

Points columns_of(const std::vector<Vec3>& points) {
  Points matrix(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    matrix.col(static_cast<Eigen::Index>(i)) = points[i];
  }
  return matrix;
}

Result<NamedPairs> pair_by_name(const NamedPoints& first, const NamedPoints& second) {
  const auto ones = index_of(first, "first"), others = index_of(second, "second");
  if (!ones) return tl::unexpected(ones.error());
  if (!others) return tl::unexpected(others.error());
  NamedPairs pairs;
  for (std::size_t i = 0; i < first.names.size(); ++i) {
    const std::string& name = first.names[i];
    const auto found = others->find(name);
    if (found == others->end()) {
      pairs.left_out.push_back(name);
    } else {
      pairs.add(name, first.points[i], second.points[found->second]);
    }
  }
  for (const std::string& name : second.names) {
    if (ones->count(name) == 0) pairs.left_out.push_back(name);
  }
  if (pairs.names.empty()) {
    return fail(ErrorCode::kEmptySet, fmt::format("no name is in both lists of {} and {} points",
                                                  first.names.size(), second.names.size()));
  }
  return pairs;
}

}  // namespace brainshift::io
