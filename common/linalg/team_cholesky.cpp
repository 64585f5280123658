// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/linalg/team_cholesky.hpp"

#include <algorithm>
#include <cassert>

namespace brainshift::linalg {
namespace {

using Eigen::Index;

constexpr Index kTeamBlock = 96;
// Below this size the team's waking costs more than it saves.
constexpr Index kSmall = 256;

}  // namespace

bool cholesky(blas::Out<double> a, ThreadTeam& team) {
  assert(a.rows() == a.cols());
  const Index n = a.rows();
  if (n <= kSmall) return blas::cholesky(a);
  for (Index first = 0; first < n; first += kTeamBlock) {
    const Index width = std::min(kTeamBlock, n - first);
    auto corner = a.block(first, first, width, width);
    if (!blas::cholesky(corner)) return false;
    const Index below = first + width, rest = n - below;
    const Index blocks = (rest + kTeamBlock - 1) / kTeamBlock;
    const auto begin = [&](Index block) { return below + block * kTeamBlock; };
    const auto size = [&](Index block) { return std::min(kTeamBlock, n - begin(block)); };
    team.split(blocks, [&](long from, long to) {
      for (Index i = from; i < to; ++i) {
        blas::solve_lower_transposed_right(corner, a.block(begin(i), first, size(i), width));
      }
    });
    // Column j of the blocks that are left, and its mirror image, cost as much together as any
    // other such pair.
    team.split((blocks + 1) / 2, [&](long from, long to) {
      const auto update = [&](Index j) {
        const auto right = a.block(begin(j), first, size(j), width);
        blas::subtract_outer(right, a.block(begin(j), begin(j), size(j), size(j)));
        const Index next = begin(j) + size(j);
        if (next < n) {
          blas::multiply_by_transposed(-1.0, a.block(next, first, n - next, width), right, 1.0,
                                       a.block(next, begin(j), n - next, size(j)));
        }
      };
      for (Index j = from; j < to; ++j) {
        update(j);
        if (blocks - 1 - j != j) update(blocks - 1 - j);
      }
    });
  }
  return true;
}

}  // namespace brainshift::linalg
