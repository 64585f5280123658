// SPDX-License-Identifier: GPL-3.0-or-later
// CompactColumns: many displacement fields of one mesh (columns of 3n numbers, node-major) in less
// than half of the memory of single precision, ready to be summed up without being unpacked.
//
// Neighbours move alike. The nodes stand in blocks of kBlockNodes at most that lie close together.
// Each block has an orthonormal basis q_1, q_2, ... of what its 3m rows do, the most needed
// direction first, and each column has whole-numbered coefficients in it:
//
//   M_bj = step_j sum over i  q_i c_ij
//
// A column that is quiet in a block needs few directions, and small coefficients in the most of
// them. So each column has, in each block, coefficients of four bytes, then of two, then of one,
// then none; how many of each is counted in eights (kTogether):
//
//   c_ij  = longs   i in [0, 8 l_1)                  |c| < 2^31
//           words   i in [8 l_1, 8 (l_1 + l_2))      |c| < 2^15
//           bytes   the next 8 l_3                   |c| < 2^7
//           0       beyond
//
// q_i is kept in single precision where a column has a coefficient beyond 2^15 (the block's first
// `wide` directions), and as s_i p_i with p_i in 16 bits elsewhere.
//
// step_j has the unit of column j. A coefficient is rounded by at most half a step; what else is
// lost is bounded by who encodes (operators/encode_columns.hpp). Rounding errors of
// different coefficients do not depend on each other, so that a sum of columns with factors x_j is
// off by about 0.3 |x| steps, not by their number.
//
// Immutable, and valid by construction. Sums are plain loops in single precision: they take the
// same bits on every x86-64 processor, and a block's sum does not depend on any other block.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift {

// What a CompactColumns is made of; also the arrays of a model file. b blocks, c columns.
struct CompactParts {
  template <typename T>
  using List = Eigen::Matrix<T, Eigen::Dynamic, 1>;

  List<float> steps;                             // c, above 0
  std::vector<NodeIndex> order;                  // every node once, block after block
  Eigen::Matrix<int, 3, Eigen::Dynamic> blocks;  // 3 x b: nodes, wide, other directions
  // Block after block:
  List<float> wide_basis;     // 3m x wide, column-major: q
  List<std::int16_t> basis;   // 3m x others, column-major: p
  List<float> basis_scales;   // others: s
  List<std::int8_t> lengths;  // 3 x c, column-major: l_1, l_2, l_3
  List<std::int32_t> longs;   // column after column, as the next two
  List<std::int16_t> words;
  List<std::int8_t> bytes;
};
// Bit for bit, but for -0 = 0.
bool operator==(const CompactParts& a, const CompactParts& b);

class CompactColumns {
 public:
  static constexpr int kBlockNodes = 128;
  static constexpr int kBlockRows = 3 * kBlockNodes;
  static constexpr int kTogether = 8;  // coefficients of one width

  CompactColumns() = default;  // no nodes, no columns
  // kInvalidArgument, with the array, for sizes that do not fit each other, nodes that do not stand
  // in `order` exactly once, and steps that are not above 0. kNotFinite.
  static Result<CompactColumns> from_parts(CompactParts parts);
  const CompactParts& parts() const { return parts_; }

  int num_nodes() const { return static_cast<int>(parts_.order.size()); }
  int num_columns() const { return static_cast<int>(parts_.steps.size()); }
  int num_blocks() const { return static_cast<int>(parts_.blocks.cols()); }
  // Memory held by the arrays.
  std::uint64_t bytes() const;

  // Where the rows of a node are: in which block, and the how many-th of its nodes it is.
  struct Place {
    int block = 0, node = 0;
  };
  Place place(NodeIndex node) const { return places_[static_cast<std::size_t>(node)]; }
  std::span<const NodeIndex> nodes(int block) const;
  // Position of the block's first node in the order of all blocks.
  int first_node(int block) const { return at(block).node; }
  // Directions of this block.
  int rank(int block) const { return at(block).rank; }

  struct Term {
    int column = 0;
    float factor = 0.0F;
  };
  // Where the coefficients of a column in a block begin, counted from the block's first ones.
  struct Start {
    std::uint32_t longs = 0, words = 0, bytes = 0;
  };
  // A block's part of every array, for the loops.
  struct BlockArrays {
    int rows = 0, wide = 0, others = 0;
    const float *steps = nullptr, *wide_basis = nullptr;
    const std::int16_t* basis = nullptr;
    const float* scales = nullptr;
    const std::int8_t* lengths = nullptr;
    const Start* starts = nullptr;
    const std::int32_t* longs = nullptr;
    const std::int16_t* words = nullptr;
    const std::int8_t* bytes = nullptr;
  };
  // out = sum over terms of factor * column, at the rows of the block (3 nodes(block).size()).
  // omitted: length, over all rows of the block, of what the last directions may be left out of the
  // sum, in its unit; fewer of them are read then.
  void sum(int block, std::span<const Term> terms, float* out, float omitted = 0.0F) const;
  // The same where the numbers are wanted one by one: the block's part of a column is basis (3m x
  // rank, column-major) times coefficients (rank).
  void basis(int block, float* out) const;
  void coefficients(int block, int column, float* out) const;
  // Squared norm of a column: that of its coefficients.
  double squared_norm(int column) const;

 private:
  // Where a block begins in each array.
  struct Offsets {
    int node = 0, rows = 0, wide = 0, others = 0, rank = 0;
    std::ptrdiff_t wide_basis = 0, basis = 0, scales = 0, longs = 0, words = 0, bytes = 0;
  };
  BlockArrays arrays(int block) const;
  const Offsets& at(int block) const { return offsets_[static_cast<std::size_t>(block)]; }
  Status check_sizes();
  // Fills starts_ for one block and moves `next` behind its coefficients.
  Status check_lengths(Eigen::Index block, Offsets& next);
  Status check_order();

  CompactParts parts_;
  std::vector<Offsets> offsets_;
  std::vector<Start> starts_;  // b x c, a block's together
  std::vector<Place> places_;
};

}  // namespace brainshift
