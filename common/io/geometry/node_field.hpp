// SPDX-License-Identifier: GPL-3.0-or-later
// A named field on the nodes or cells of a mesh, as mesh files carry it.
#pragma once

#include <string>

#include "common/core/types.hpp"

namespace brainshift::io {

struct NodeField {
  std::string name;
  Eigen::MatrixXd values;  // 1 x n or 3 x n
};

}  // namespace brainshift::io
