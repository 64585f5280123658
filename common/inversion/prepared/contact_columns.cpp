// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/prepared/contact_columns.hpp"

#include <cmath>
#include <mutex>
#include <utility>

namespace brainshift::inversion {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;

// How the slaves are dealt.
struct Blocks {
  int size, count;
  explicit Blocks(std::size_t slaves)
      : size(BlockRunner::block_size(static_cast<int>(slaves))),
        count((static_cast<int>(slaves) + size - 1) / size) {}
};

Points slave_positions(const PreparedModel& model, const CondensedOperators& result) {
  Points positions(3, static_cast<Eigen::Index>(result.slaves.size()));
  for (std::size_t i = 0; i < result.slaves.size(); ++i) {
    positions.col(static_cast<Eigen::Index>(i)) = model.model().mesh.nodes.col(result.slaves[i]);
  }
  return positions;
}

// The columns of u in the order of the nodes' blocks.
void sort_nodes(const MatrixXd& u, const SpatialBlocks& nodes, MatrixXf& sorted) {
  for (std::size_t i = 0; i < nodes.order.size(); ++i) {
    sorted.middleCols<3>(3 * static_cast<Eigen::Index>(i)) =
        u.middleCols<3>(3L * nodes.order[i]).cast<float>();
  }
}

// Phi's columns of the slaves that have the responses u, k x 3n.
void compliance_of(const MatrixXd& u, const CondensedOperators& operators, MatrixXd& compliance) {
  for (std::size_t i = 0; i < operators.slaves.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    compliance.row(row) =
        (u.middleCols<3>(3L * operators.slaves[i]) * operators.slave_normals.col(row)).transpose();
  }
}

// Phi is symmetric but for rounding.
void make_symmetric(MatrixXd& phi) {
  for (Eigen::Index j = 0; j < phi.cols(); ++j) {
    for (Eigen::Index i = 0; i < j; ++i) phi(i, j) = phi(j, i) = 0.5 * (phi(i, j) + phi(j, i));
  }
}

// Keeps the rows of `blocks` blocks in memory for as long as the store or a copy of it lives.
BlockStore memory_store(int blocks) {
  const auto kept = std::make_shared<std::vector<MatrixXf>>(static_cast<std::size_t>(blocks));
  BlockStore store;
  store.load = [](int, MatrixXf&, MatrixXd&) { return false; };
  store.save = [kept](int index, const MatrixXf& rows, const MatrixXd&) -> Status {
    (*kept)[static_cast<std::size_t>(index)] = rows;
    return {};
  };
  store.read = [kept](int index, Eigen::Index first, MatrixXf& out) -> Status {
    out = (*kept)[static_cast<std::size_t>(index)].middleCols(first, out.cols());
    return {};
  };
  return store;
}

}  // namespace

ColumnGroup ContactColumns::group(float step) const {
  ColumnGroup group;
  group.count = static_cast<int>(order.size());
  group.step = step;
  group.greatest = greatest;
  group.rows = [this](std::span<const NodeIndex>, Eigen::Index place, MatrixXf& out) -> Status {
    MatrixXf part;
    const Blocks blocks(order.size());
    for (int block = 0; block < blocks.count; ++block) {
      const auto slaves =
          std::span(order).subspan(static_cast<std::size_t>(Eigen::Index{block} * blocks.size));
      part.resize(std::min<Eigen::Index>(blocks.size, static_cast<Eigen::Index>(slaves.size())),
                  out.rows());
      if (auto status = store.read(block, 3 * place, part); !status) return status;
      for (Eigen::Index j = 0; j < part.rows(); ++j) {
        out.col(slaves[static_cast<std::size_t>(j)]) = part.row(j).transpose();
      }
    }
    return {};
  };
  return group;
}

void add_slaves(const PreparedModel& model, CondensedOperators& result) {
  const auto& pairs = model.forward().contact().pairs();
  const auto s = static_cast<Eigen::Index>(pairs.size());
  result.slave_normals.resize(3, s);
  result.initial_penetration_mm.resize(s);
  for (Eigen::Index i = 0; i < s; ++i) {
    const auto& pair = pairs[static_cast<std::size_t>(i)];
    result.slaves.push_back(pair.slave);
    result.slave_normals.col(i) = pair.normal;
    result.initial_penetration_mm[i] = pair.initial_penetration_mm;
  }
}

Result<ContactColumns> solve_contact_columns(const PreparedModel& model, const SpatialBlocks& nodes,
                                             BlockStore store, BlockRunner& runner,
                                             CondensedOperators& result) {
  const auto s = static_cast<Eigen::Index>(result.slaves.size());
  const Eigen::Index rows = 3 * model.model().mesh.num_nodes();
  const Blocks blocks(result.slaves.size());
  ContactColumns columns;
  columns.order = spatial_blocks(slave_positions(model, result), blocks.size).order;
  columns.store = store.keeps() ? std::move(store) : memory_store(blocks.count);
  result.compliance.resize(s, s);
  std::mutex mutex;  // of the store, the greatest number and what was not finite
  bool finite = true;
  const auto work = [&](int first, int count, BlockRunner::Member& own) -> Status {
    const auto slave = [&](int j) {
      return columns.order[static_cast<std::size_t>(Eigen::Index{first} + j)];
    };
    MatrixXf sorted(count, rows);
    MatrixXd compliance(s, count);
    bool kept = false;
    {
      const std::lock_guard lock(mutex);
      kept = columns.store.load(first / blocks.size, sorted, compliance);
    }
    if (!kept) {
      own.loads.setZero(count, rows);
      for (int j = 0; j < count; ++j) {
        own.loads.row(j).segment<3>(3L * result.slaves[static_cast<std::size_t>(slave(j))]) =
            result.slave_normals.col(slave(j)).transpose();
      }
      if (auto solved = own.solver.solve(own.loads, own.solved); !solved) return solved;
      compliance_of(own.solved, result, compliance);
      sort_nodes(own.solved, nodes, sorted);
    }
    const float greatest = greatest_of(sorted);
    for (int j = 0; j < count; ++j) result.compliance.col(slave(j)) = compliance.col(j);
    const std::lock_guard lock(mutex);
    finite = finite && std::isfinite(greatest) && compliance.allFinite();
    columns.greatest = std::max(columns.greatest, greatest);
    return kept ? Status{} : columns.store.save(first / blocks.size, sorted, compliance);
  };
  if (auto status = runner.run("contact columns", static_cast<int>(s), work); !status) {
    return tl::unexpected(status.error());
  }
  if (!finite) {
    return fail(ErrorCode::kNotFinite,
                "contact columns: the compliance of the slaves is not finite");
  }
  make_symmetric(result.compliance);
  return columns;
}

}  // namespace brainshift::inversion
