// SPDX-License-Identifier: GPL-3.0-or-later
// BlockRunner: work on many columns, in blocks dealt to the cores in a fixed partition; every core
// has its own solver. What a block gives does not depend on the core that worked on it: results are
// bit-identical for any number of threads, as long as blocks write to different places.
#pragma once

#include <algorithm>
#include <atomic>
#include <memory>
#include <stop_token>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/core/thread_team.hpp"
#include "common/fem/stiffness_factor.hpp"
#include "common/inversion/prepared/prepared_model.hpp"

namespace brainshift::inversion {

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

}  // namespace brainshift::inversion
