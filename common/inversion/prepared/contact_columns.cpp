// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/prepared/contact_columns.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>

namespace brainshift::inversion {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;

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

// What the processes have to do with each other's columns: `rows` at the nodes of each one's part.
class Exchange {
 public:
  Exchange(Ranks& ranks, const SpatialBlocks& nodes) : ranks_(ranks), nodes_(nodes) {}

  // Places of the nodes of process r.
  Eigen::Index first(int r) const {
    return nodes_.first[static_cast<std::size_t>(ranks_.first(r, nodes_.size()))];
  }
  // index: of the own block, -1 none. -> those of all processes, at the own nodes.
  std::vector<std::pair<int, MatrixXf>> operator()(int index, const MatrixXf& rows) const {
    std::vector<Ranks::Bytes> messages(static_cast<std::size_t>(ranks_.size()));
    for (int r = 0; index >= 0 && r < ranks_.size(); ++r) {
      const auto part = rows.middleCols(3 * first(r), 3 * (first(r + 1) - first(r)));
      const auto bytes = static_cast<std::size_t>(part.size()) * sizeof(float);
      Ranks::Bytes& message = messages[static_cast<std::size_t>(r)];
      message.resize(sizeof(int) + bytes);
      std::memcpy(message.data(), &index, sizeof(int));
      if (bytes > 0) std::memcpy(message.data() + sizeof(int), part.data(), bytes);
    }
    std::vector<std::pair<int, MatrixXf>> blocks;
    const Eigen::Index columns = 3 * (first(ranks_.rank() + 1) - first(ranks_.rank()));
    for (const Ranks::Bytes& message : ranks_.exchange(std::move(messages))) {
      if (message.empty()) continue;
      const std::size_t bytes = message.size() - sizeof(int);
      auto& [of, part] = blocks.emplace_back();
      std::memcpy(&of, message.data(), sizeof(int));
      if (bytes == 0) continue;
      part.resize(static_cast<Eigen::Index>(bytes / sizeof(float)) / columns, columns);
      std::memcpy(part.data(), message.data() + sizeof(int), bytes);
    }
    return blocks;
  }

 private:
  Ranks& ranks_;
  const SpatialBlocks& nodes_;
};

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
    for (int block = 0; block * block_size < static_cast<int>(order.size()); ++block) {
      const auto slaves = std::span(order).subspan(static_cast<std::size_t>(block * block_size));
      part.resize(std::min<Eigen::Index>(block_size, static_cast<Eigen::Index>(slaves.size())),
                  out.rows());
      if (auto status = store.read(block, 3 * (place - first_place), part); !status) return status;
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
  ContactColumns columns;
  columns.block_size = runner.size_for(static_cast<int>(s));
  columns.order = spatial_blocks(slave_positions(model, result), columns.block_size).order;
  const int size = columns.block_size, blocks = (static_cast<int>(s) + size - 1) / size;
  columns.store = store.keeps() ? std::move(store) : memory_store(blocks);
  result.compliance.setZero(s, s);
  std::optional<Exchange> exchange;
  if (runner.ranks() != nullptr) {
    exchange.emplace(*runner.ranks(), nodes);
    columns.first_place = exchange->first(runner.ranks()->rank());
  }
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
      kept = !exchange && columns.store.load(first / size, sorted, compliance);
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
    if (exchange) {
      for (const auto& [index, part] : (*exchange)(count > 0 ? first / size : -1, sorted)) {
        if (auto saved = columns.store.save(index, part, {}); !saved) return saved;
      }
      kept = true;
    }
    for (int j = 0; j < count; ++j) result.compliance.col(slave(j)) = compliance.col(j);
    const std::lock_guard lock(mutex);
    finite = finite && std::isfinite(greatest) && compliance.allFinite();
    columns.greatest = std::max(columns.greatest, greatest);
    return kept ? Status{} : columns.store.save(first / size, sorted, compliance);
  };
  if (auto status = runner.run("contact columns", static_cast<int>(s), work); !status) {
    return tl::unexpected(status.error());
  }
  // One figure of each process, and all can be read everywhere.
  std::vector<float> all(exchange ? static_cast<std::size_t>(runner.ranks()->size()) : 1U);
  all[exchange ? static_cast<std::size_t>(runner.ranks()->rank()) : 0U] =
      finite ? columns.greatest : std::numeric_limits<float>::infinity();
  runner.sum(all);
  columns.greatest = *std::max_element(all.begin(), all.end());
  if (!std::isfinite(columns.greatest)) {
    return fail(ErrorCode::kNotFinite,
                "contact columns: the compliance of the slaves is not finite");
  }
  runner.sum(result.compliance);
  make_symmetric(result.compliance);
  return columns;
}

}  // namespace brainshift::inversion
