// SPDX-License-Identifier: GPL-3.0-or-later
// G = K^-1 N, the responses to unit forces along the slaves' normals, and Phi = N^T G.
//
// Slaves that are neighbours are solved together (linalg/cholesky.hpp). A block of
// columns goes to a BlockStore as soon as it is finished, and comes back by rows when all of G is
// made compact: with a store on disk G is never in memory as a whole.
#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <stop_token>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/core/thread_team.hpp"
#include "common/fem/stiffness_factor.hpp"
#include "common/inversion/prepared/prepared_model.hpp"
#include "common/operators/condensed_operators.hpp"
#include "common/operators/encode_columns.hpp"

namespace brainshift::inversion {

// BlockRunner: work on many columns, in blocks dealt to the cores in a fixed partition; every core
// has its own solver. What a block gives does not depend on the core that worked on it: results are
// bit-identical for any number of threads, as long as blocks write to different places.
//
// By several processes (PreparedModel::ranks): consecutive blocks are one process's own, and each
// has one thread, since a solve is made by all of them. Each works on as many blocks as the others,
// with none of its columns where it has fewer: `work` then solves all the same.
class BlockRunner {
 public:
  // Right-hand sides per block at most: from here on a solve is bound by arithmetic, no longer by
  // reading the factor.
  static constexpr int kBlock = 96;
  // Columns of each block but the last, which may have fewer. An even number of blocks of the same
  // size, so that two or four cores end at the same time; whatever their number is, since a block's
  // numbers depend on its size in their last bits.
  // block: at most; of several processes kSharedBlock instead.
  static int block_size(int columns, const Ranks* ranks = nullptr, int block = kBlock) {
    const int together = ranks == nullptr ? 2 : ranks->size();
    const int most = together * (ranks == nullptr ? block : kSharedBlock);
    const int rounds = std::max(1, (columns + most - 1) / most);
    return std::max(1, (columns + together * rounds - 1) / (together * rounds));
  }
  // Of several processes: each has that many of its own, and its part of everybody's.
  static constexpr int kSharedBlock = 24;

  // The own columns are [own_first(columns), own_first(columns) + own_count(columns)).
  int own_first(int columns) const { return std::min(columns, part(columns, rank())); }
  int own_count(int columns) const {
    return std::min(columns, part(columns, rank() + 1)) - own_first(columns);
  }

  // What one core works with. The matrices are for `work` below to use as it likes, with a field
  // per row (BlockSolver); they keep their memory from one block to the next.
  struct Member {
    fem::BlockSolver solver;
    Eigen::MatrixXd loads, solved, forces;
  };

  // Keeps a reference to the model. threads: 0 means as many as cores. block: columns of a block at
  // most.
  BlockRunner(const PreparedModel& model, Progress progress, std::stop_token stop, int threads,
              int block = kBlock)
      : block_(block),
        ranks_(model.ranks()),
        team_(ranks_ != nullptr ? 1 : threads),
        progress_(std::move(progress)),
        stop_(std::move(stop)) {
    for (int i = 0; i < team_.size(); ++i) {
      members_.push_back(std::make_unique<Member>(
          Member{{model.forward().stiffness(), model.forward().factor(), model.forward().dofs()},
                 {},
                 {},
                 {}}));
    }
  }
  // Status work(first, count, Member&) for column ranges that cover [0, columns). kUnavailable when
  // stopped; else the error of a block, after which no other is begun.
  template <typename Work>
  Status run(std::string_view stage, int columns, const Work& work) {
    if (ranks_ != nullptr) return run_together(stage, columns, work);
    const int size = size_for(columns), blocks = (columns + size - 1) / size;
    std::atomic<int> done{0};
    std::atomic<bool> failed{false};
    std::vector<Status> statuses(static_cast<std::size_t>(team_.size()));
    auto task = [&](int member) {
      for (int block = member; block < blocks; block += team_.size()) {
        if (stop_.stop_requested() || failed) return;
        const int first = block * size;
        Status& status = statuses[static_cast<std::size_t>(member)];
        status = work(first, std::min(size, columns - first),
                      *members_[static_cast<std::size_t>(member)]);
        if (!status) {
          failed = true;
          return;
        }
        ++done;
        if (member == 0) report(progress_, stage, static_cast<double>(done) / blocks);
      }
    };
    report(progress_, stage, 0.0);
    team_.run(task);
    report(progress_, stage, 1.0);
    for (const Status& status : statuses) {
      if (!status) return status;
    }
    if (done != blocks) return fail(ErrorCode::kUnavailable, "preparation was stopped");
    return {};
  }

  // Columns of a block of `run`.
  int size_for(int columns) const { return block_size(columns, ranks_, block_); }
  Ranks* ranks() const { return ranks_; }
  // Sums over the processes, in place.
  template <typename Matrix>
  void sum(Matrix& numbers) const {
    if (ranks_ != nullptr) {
      ranks_->sum(std::span(numbers.data(), static_cast<std::size_t>(numbers.size())));
    }
  }
  // The first error that a process has.
  Status agree(const Status& own) const { return ranks_ != nullptr ? ranks_->agree(own) : own; }

 private:
  int rank() const { return ranks_ != nullptr ? ranks_->rank() : 0; }
  int rounds(int columns) const {
    const int each = size_for(columns) * ranks_->size();
    return (columns + each - 1) / each;
  }
  // The first column of process r.
  int part(int columns, int r) const {
    return ranks_ == nullptr ? r * columns : r * rounds(columns) * size_for(columns);
  }
  template <typename Work>
  Status run_together(std::string_view stage, int columns, const Work& work) {
    const int size = size_for(columns), all = rounds(columns);
    const int first = own_first(columns), end = first + own_count(columns);
    report(progress_, stage, 0.0);
    for (int round = 0; round < all; ++round) {
      const int at = std::min(end, first + round * size);
      Status status = work(at, std::min(size, end - at), *members_.front());
      if (status && stop_.stop_requested()) {
        status = fail(ErrorCode::kUnavailable, "preparation was stopped");
      }
      if (status = agree(status); !status) return status;
      report(progress_, stage, static_cast<double>(round + 1) / all);
    }
    return {};
  }

  int block_;
  Ranks* ranks_;
  ThreadTeam team_;
  Progress progress_;
  std::stop_token stop_;
  std::vector<std::unique_ptr<Member>> members_;
};

// Keeps finished blocks; on disk, so that they need no memory and an interrupted preparation can go
// on. `rows`: count x 3n, the block's columns as rows, so that the 3m numbers of neighbouring nodes
// in a column stand near those of the next one; nodes in the order of node_blocks().
struct BlockStore {
  // Fills both arrays, which have the shape of the block; false when block `index` is not kept.
  std::function<bool(int index, Eigen::MatrixXf& rows, Eigen::MatrixXd& compliance)> load;
  std::function<Status(int index, const Eigen::MatrixXf& rows, const Eigen::MatrixXd& compliance)>
      save;
  // Columns [first, first + out.cols()) of the `rows` of a block that was saved or loaded. Called
  // by several threads at once; the others by one at a time.
  std::function<Status(int index, Eigen::Index first, Eigen::MatrixXf& out)> read;

  bool keeps() const { return static_cast<bool>(save); }
};
struct ContactColumns {
  std::vector<int> order;        // of the slaves, block after block
  int block_size = 1;            // BlockRunner::size_for()
  Eigen::Index first_place = 0;  // the store's rows begin with this node of node_blocks()
  BlockStore store;
  float greatest = 0.0F;

  // For encode_columns(): the columns in the order of the slaves. Refers to this.
  ColumnGroup group(float step) const;
};

// Fills slaves, slave_normals and initial_penetration_mm.
void add_slaves(const PreparedModel& model, CondensedOperators& result);

// Fills compliance; after add_slaves(). nodes: node_blocks() of the mesh. store: that of the
// columns, or one that keeps nothing: then they stay in memory. progress: stage "contact columns".
// By several processes: each keeps all columns, at the nodes of its own part of the blocks
// (Ranks::first) alone.
// Errors of the runner and of the store; kNotFinite.
Result<ContactColumns> solve_contact_columns(const PreparedModel& model, const SpatialBlocks& nodes,
                                             BlockStore store, BlockRunner& runner,
                                             CondensedOperators& result);

}  // namespace brainshift::inversion
