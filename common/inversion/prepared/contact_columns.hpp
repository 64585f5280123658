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
class BlockRunner {
 public:
  // Right-hand sides per block at most: from here on a solve is bound by arithmetic, no longer by
  // reading the factor.
  static constexpr int kBlock = 96;
  // Columns of each block but the last, which may have fewer. An even number of blocks of the same
  // size, so that two or four cores end at the same time; whatever their number is, since a block's
  // numbers depend on its size in their last bits.
  static int block_size(int columns) {
    const int pairs = std::max(1, (columns + 2 * kBlock - 1) / (2 * kBlock));
    return std::max(1, (columns + 2 * pairs - 1) / (2 * pairs));
  }

  // What one core works with. The matrices are for `work` below to use as it likes, with a field
  // per row (BlockSolver); they keep their memory from one block to the next.
  struct Member {
    fem::BlockSolver solver;
    Eigen::MatrixXd loads, solved, forces;
  };

  // Keeps a reference to the model. threads: 0 means as many as cores.
  BlockRunner(const PreparedModel& model, Progress progress, std::stop_token stop, int threads)
      : team_(threads), progress_(std::move(progress)), stop_(std::move(stop)) {
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
    const int size = block_size(columns), blocks = (columns + size - 1) / size;
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

 private:
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
  std::vector<int> order;  // of the slaves, block after block of BlockRunner::block_size()
  BlockStore store;
  float greatest = 0.0F;

  // For encode_columns(): the columns in the order of the slaves. Refers to this.
  ColumnGroup group(float step) const;
};

// Fills slaves, slave_normals and initial_penetration_mm.
void add_slaves(const PreparedModel& model, CondensedOperators& result);

// Fills compliance; after add_slaves(). nodes: node_blocks() of the mesh. store: that of the
// columns, or one that keeps nothing: then they stay in memory. progress: stage "contact columns".
// Errors of the runner and of the store; kNotFinite.
Result<ContactColumns> solve_contact_columns(const PreparedModel& model, const SpatialBlocks& nodes,
                                             BlockStore store, BlockRunner& runner,
                                             CondensedOperators& result);

}  // namespace brainshift::inversion
