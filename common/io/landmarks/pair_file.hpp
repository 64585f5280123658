// SPDX-License-Identifier: GPL-3.0-or-later
// Homologous landmarks: where a structure lay before surgery, and where it was found during it. mm
// RAS.
//
// In one file:
//   .csv  rows of 6 numbers (before x, y, z, during x, y, z), or of a name and these; or any
//         columns below a heading that names the six, e.g. x_before,y_before,z_before,x_during, ...
//         (for before also pre, preop, src, source, undeformed; for during after, intra, intraop,
//         post, postop, dst, destination, deformed; files/table.hpp) and perhaps label, name or
//         row, and defined. Another heading is refused.
//   .tag  MNI tag points of two volumes: 6 numbers, perhaps weight, structure and patient, and a
//         name in quotation marks
//         (source: MNI, "MNI Tag Point File", as register and tagtoxfm of MINC read it)
// In two files: point_file.hpp, paired by name.
// Lines of a .csv that begin with # are skipped; in a .tag what follows % or #.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"
#include "common/io/landmarks/point_file.hpp"

namespace brainshift::io {

// Pair i: first[i] and second[i], called names[i].
struct NamedPairs {
  std::vector<std::string> names;
  std::vector<Vec3> first, second;  // mm
  // Names that only one of two lists has, in the order of the lists.
  std::vector<std::string> left_out = {};

  void add(std::string name, const Vec3& one, const Vec3& other);
};

// In the order of `first`. kInvalidArgument, naming the list ("first", "second") and the point: a
// point without a name, a name that a list has twice. kEmptySet: no name is in both.
Result<NamedPairs> pair_by_name(const NamedPoints& first, const NamedPoints& second);

// first: before surgery, second: during it. kNotFound; kUnreadable or kEmptySet naming the file,
// the line and what is wrong there; for two files also the errors of pair_by_name, naming both
// files.
Result<NamedPairs> read_pairs(const std::filesystem::path& path);
Result<NamedPairs> read_pairs(const std::filesystem::path& before,
                              const std::filesystem::path& during);

}  // namespace brainshift::io
