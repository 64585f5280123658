// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/prepared/output_operators.hpp"

#include <algorithm>

#include "common/inversion/prepared/block_runner.hpp"
#include "common/inversion/prepared/data_region.hpp"
#include "common/inversion/prepared/memory_limit.hpp"
#include "common/linalg/blas.hpp"
#include "common/linalg/blas_threads.hpp"

namespace brainshift::inversion {
namespace {

using Eigen::MatrixXd;

// One row of H: a unit force at a node, and the component of a displacement along it.
struct Output {
  NodeIndex node = 0;
  Vec3 direction = Vec3::Zero();
};

std::vector<Output> all_outputs(const PreparedModel& model, const std::vector<NodeIndex>& region) {
  std::vector<Output> outputs;
  for (const NodeIndex node : region) {
    for (int axis = 0; axis < 3; ++axis) outputs.push_back({node, Vec3::Unit(axis)});
  }
  for (const auto& pair : model.forward().contact().pairs()) {
    outputs.push_back({pair.slave, pair.normal});
  }
  return outputs;
}

void copy_lower_to_upper(MatrixXd& matrix) {
  for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
    for (Eigen::Index i = 0; i < j; ++i) matrix(i, j) = matrix(j, i);
  }
}

}  // namespace

std::uint64_t output_operators_bytes(int nodes, int outputs, int threads) {
  const auto n3 = static_cast<std::uint64_t>(3) * static_cast<std::uint64_t>(nodes);
  const auto h = static_cast<std::uint64_t>(outputs);
  const std::uint64_t blocks =
      8 * n3 * BlockRunner::kBlock * 6 * static_cast<std::uint64_t>(threads);
  return 8 * n3 * h + 2 * 8 * h * h + blocks;  // X; Phi, Psi
}

Result<OutputOperators> output_operators(const PreparedModel& model, const Progress& progress,
                                         const std::stop_token& stop, int threads) {
  linalg::use_single_threaded_blas();
  OutputOperators result;
  result.region = data_region(model.model());
  const std::vector<Output> outputs = all_outputs(model, result.region);
  const int nodes = model.model().mesh.num_nodes(), h = static_cast<int>(outputs.size());
  const int used_threads =
      threads > 0 ? threads : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const std::uint64_t bytes =
      model.timings().bytes + output_operators_bytes(nodes, h, used_threads);
  if (auto status = check_memory(model, bytes); !status) return tl::unexpected(status.error());

  BlockRunner runner(model, progress, stop, threads);
  MatrixXd x(h, 3 * nodes);  // H K^-1
  result.compliance.resize(h, h);
  result.covariance.setZero(h, h);
  const auto solve_block = [&](int first, int count, BlockRunner::Member& own) -> Status {
    own.loads.setZero(count, 3 * nodes);
    for (int j = 0; j < count; ++j) {
      const Output& output = outputs[static_cast<std::size_t>(Eigen::Index{first} + j)];
      own.loads.row(j).segment<3>(3 * output.node) = output.direction.transpose();
    }
    if (auto status = own.solver.solve(own.loads, own.solved); !status) return status;
    const MatrixXd& u = own.solved;
    for (int j = 0; j < count; ++j) {
      for (int i = first + j; i < h; ++i) {
        const Output& output = outputs[static_cast<std::size_t>(i)];
        result.compliance(i, first + j) =
            u.row(j).segment<3>(3 * output.node).dot(output.direction);
      }
    }
    x.middleRows(first, count) = u;
    return {};
  };
  // Lower triangle only: rows from the block's first one on.
  const auto covariance_block = [&](int first, int count, BlockRunner::Member& own) -> Status {
    MatrixXd& forces = own.forces;
    model.prior().apply_remainders(x.middleRows(first, count), forces);
    linalg::blas::multiply_by_transposed(1.0, x.bottomRows(h - first), forces, 0.0,
                                         result.covariance.block(first, first, h - first, count));
    return {};
  };
  auto status = runner.run("influence columns", h, solve_block);
  if (status) status = runner.run("prior covariance", h, covariance_block);
  if (!status) return tl::unexpected(status.error());
  if (const MatrixXd& modes = model.prior().modes(); modes.cols() > 0) {
    MatrixXd seen(h, modes.cols());
    linalg::blas::multiply(1.0, x, modes, 0.0, seen);
    linalg::blas::multiply_by_transposed(1.0, seen, seen, 1.0, result.covariance);
  }
  copy_lower_to_upper(result.compliance);
  copy_lower_to_upper(result.covariance);
  if (!result.compliance.allFinite() || !result.covariance.allFinite()) {
    return fail(ErrorCode::kNotFinite,
                "output operators: a compliance or covariance is not finite");
  }
  return result;
}

}  // namespace brainshift::inversion
