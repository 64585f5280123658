// SPDX-License-Identifier: GPL-3.0-or-later
// CompactColumns: many displacement fields of one mesh (columns of 3n numbers, node-major) in about
// a quarter of the memory of single precision, ready to be summed up without being unpacked.
//
// Neighbours move alike. The nodes stand in blocks of kBlockNodes at most that lie close together.
// Each block has an orthonormal basis q_1, q_2, ... of what its 3m rows do, and each column has
// whole-numbered coefficients in it:
//
//   M_bj = step_j ( sum over wide i    q_i     (256 w_ij + y_ij)
//                 + sum over middle i  s_i p_i  w_ij
//                 + sum over narrow i  s_i p_i  y_ij )
//
//   w_ij  16 bits ("words"),  y_ij  8 bits ("bytes");  q_i  single precision;  s_i p_i ~ q_i with
//   p_i in 16 bits. A coefficient has three, two or one bytes, by the largest of its row.
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
  Eigen::Matrix<int, 4, Eigen::Dynamic> blocks;  // 4 x b: nodes, wide, middle, narrow
  // Block after block, each column-major:
  List<float> wide_basis;    // 3m x wide: q
  List<std::int16_t> basis;  // 3m x (middle + narrow): p
  List<float> basis_scales;  // middle + narrow: s
  List<std::int16_t> words;  // (wide + middle) x c: w
  List<std::int8_t> bytes;   // (wide + narrow) x c: y
};
// Bit for bit, but for -0 = 0.
bool operator==(const CompactParts& a, const CompactParts& b);

class CompactColumns {
 public:
  static constexpr int kBlockNodes = 128;
  static constexpr int kBlockRows = 3 * kBlockNodes;

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
  // Coefficients of a column in this block.
  int rank(int block) const { return at(block).rank; }

  struct Term {
    int column = 0;
    float factor = 0.0F;
  };
  // A block's part of every array, for the loops.
  struct BlockArrays {
    int rows = 0, wide = 0, middle = 0, narrow = 0;
    const float *steps = nullptr, *wide_basis = nullptr;
    const std::int16_t* basis = nullptr;
    const float* scales = nullptr;
    const std::int16_t* words = nullptr;
    const std::int8_t* bytes = nullptr;
  };
  // out = sum over terms of factor * column, at the rows of the block (3 nodes(block).size()).
  void sum(int block, std::span<const Term> terms, float* out) const;
  // The same where the numbers are wanted one by one: the block's part of a column is basis (3m x
  // rank, column-major) times coefficients (rank).
  void basis(int block, float* out) const;
  void coefficients(int block, int column, float* out) const;
  // Squared norm of a column: that of its coefficients.
  double squared_norm(int column) const;

 private:
  // Where a block begins in each array.
  struct Offsets {
    int node = 0, rows = 0, wide = 0, middle = 0, narrow = 0, rank = 0;
    std::ptrdiff_t wide_basis = 0, basis = 0, scales = 0, words = 0, bytes = 0;
  };
  BlockArrays arrays(int block) const;
  const Offsets& at(int block) const { return offsets_[static_cast<std::size_t>(block)]; }
  Status check_sizes();
  Status check_order();

  CompactParts parts_;
  std::vector<Offsets> offsets_;
  std::vector<Place> places_;
};

}  // namespace brainshift
