// SPDX-License-Identifier: GPL-3.0-or-later
// Points with names, and two lists of them paired by name.
#pragma once

#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::io {

// As many names as points. A name may be empty.
struct NamedPoints {
  std::vector<std::string> names;
  std::vector<Vec3> points;  // mm

  void add(std::string name, const Vec3& point);
  // Every point has a name.
  bool all_named() const;
};

// Pair i: first[i] and second[i], called names[i].
struct NamedPairs {
  std::vector<std::string> names;
  std::vector<Vec3> first, second;  // mm
  // Names that only one of two lists has, in the order of the lists.
  std::vector<std::string> left_out = {};

  void add(std::string name, const Vec3& one, const Vec3& other);
};

// As columns, 3 x n.
Points columns_of(const std::vector<Vec3>& points);

// In the order of `first`. kInvalidArgument, naming the list ("first", "second") and the point: a
// point without a name, a name that a list has twice. kEmptySet: no name is in both.
Result<NamedPairs> pair_by_name(const NamedPoints& first, const NamedPoints& second);

}  // namespace brainshift::io
