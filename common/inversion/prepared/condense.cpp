// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/prepared/condense.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <numeric>
#include <vector>

#include "common/core/random.hpp"
#include "common/geometry/spread_nodes.hpp"
#include "common/inversion/prepared/block_runner.hpp"
#include "common/inversion/prepared/data_region.hpp"
#include "common/inversion/prepared/memory_limit.hpp"
#include "common/linalg/blas.hpp"
#include "common/operators/encode_columns.hpp"
#include "common/values/quality.hpp"

namespace brainshift::inversion {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;

constexpr int kBlock = BlockRunner::kBlock;
// Test vectors beyond the modes that are kept. Far more than the 5 to 10 that Halko et al.
// recommend, because the spectrum falls slowly: 32 left 0.013 mm in a swollen brain with 659 active
// slaves, about 200 left 0.008 mm.
constexpr int kOversampling = 192;
// Weight of slaves in the test vectors, against 1 near the data: they matter through contact only.
// On the default head 0.1 halves the error of 0 and of 0.3 (docs/decisions/0008).
constexpr double kSlaveWeight = 0.1;
// Control nodes at which diag(C) is computed; it is smooth, and interpolated to the others.
constexpr int kVarianceNodes = 128;
// A control node with less weight in the interpolation at a node has no say there. At a control
// node its own weight is all but 1.
constexpr float kLeastControlWeight = 1e-4F;
constexpr std::uint64_t kSeed = 20091115;  // any fixed number

// Step 1: G and Phi.
Status contact_columns(const PreparedModel& model, const CondenseOptions& options,
                       BlockRunner& runner, MatrixXf& all_columns, CondensedOperators& result) {
  const auto& pairs = model.forward().contact().pairs();
  const int s = static_cast<int>(pairs.size());
  const Eigen::Index rows = 3 * model.model().mesh.num_nodes();
  all_columns.resize(rows, s);
  result.compliance.resize(s, s);
  result.slave_normals.resize(3, s);
  result.initial_penetration_mm.resize(s);
  for (int i = 0; i < s; ++i) {
    const auto& pair = pairs[static_cast<std::size_t>(i)];
    result.slaves.push_back(pair.slave);
    result.slave_normals.col(i) = pair.normal;
    result.initial_penetration_mm[i] = pair.initial_penetration_mm;
  }
  std::mutex store_mutex;
  auto status = runner.run("contact columns", s, [&](int first, int count, auto& own) -> Status {
    MatrixXf columns(rows, count);
    MatrixXd compliance(s, count);
    bool kept = false;
    if (options.store.load) {
      const std::lock_guard lock(store_mutex);
      kept = options.store.load(first / kBlock, columns, compliance);
    }
    if (!kept) {
      own.loads.setZero(rows, count);
      for (int j = 0; j < count; ++j) {
        const auto slave = static_cast<std::size_t>(first) + static_cast<std::size_t>(j);
        own.loads.col(j).template segment<3>(3 * result.slaves[slave]) =
            result.slave_normals.col(first + j);
      }
      if (auto solved = own.solver.solve(own.loads, own.solved); !solved) return solved;
      const MatrixXd& u = own.solved;
      for (int j = 0; j < count; ++j) {
        for (int i = 0; i < s; ++i) {
          compliance(i, j) = result.slave_normals.col(i).dot(
              u.col(j).segment<3>(3 * result.slaves[static_cast<std::size_t>(i)]));
        }
      }
      columns = u.cast<float>();
      if (options.store.save) {
        const std::lock_guard lock(store_mutex);
        options.store.save(first / kBlock, columns, compliance);
      }
    }
    all_columns.middleCols(first, count) = columns;
    result.compliance.middleCols(first, count) = compliance;
    return {};
  });
  // Symmetric but for rounding.
  for (int j = 0; j < s; ++j) {
    for (int i = 0; i < j; ++i) {
      result.compliance(i, j) = result.compliance(j, i) =
          0.5 * (result.compliance(i, j) + result.compliance(j, i));
    }
  }
  return status;
}

// Omega: normally distributed near the data and, weaker, along the slaves' normals.
MatrixXd test_vectors(const CondensedOperators& operators, Eigen::Index rows, int count) {
  Random random(kSeed);
  MatrixXd omega = MatrixXd::Zero(rows, count);
  for (int j = 0; j < count; ++j) {
    for (const NodeIndex node : operators.region) {
      for (int axis = 0; axis < 3; ++axis) omega(3 * node + axis, j) = random.normal();
    }
    for (std::size_t i = 0; i < operators.slaves.size(); ++i) {
      omega.col(j).segment<3>(3 * operators.slaves[i]) +=
          kSlaveWeight * random.normal() *
          operators.slave_normals.col(static_cast<Eigen::Index>(i));
    }
  }
  return omega;
}

// How many modes each remainder keeps of those that the load families leave of `max_rank`.
std::array<int, kRemainders> kept_modes(const CaseConfig& config, int loads, Eigen::Index rows) {
  // A coarse field needs fewer than a fine one.
  std::array<double, kRemainders> share = {0.4, 0.4, 0.2};
  if (config.prior.force_density_sd_n_m3 == 0.0) share[0] = 0.0;
  if (config.prior.medium_density_sd_n_m3 == 0.0) share[1] = 0.0;
  if (config.prior.coarse_density_sd_n_m3 == 0.0) share[2] = 0.0;
  const double all = share[0] + share[1] + share[2];  // 0: no remainder
  const int left = std::max(kRemainders, config.condensed.max_rank - loads);
  std::array<int, kRemainders> kept{};
  for (std::size_t g = 0; g < kept.size(); ++g) {
    if (share[g] == 0.0) continue;
    kept[g] = static_cast<int>(std::clamp(share[g] / all * left, 1.0, static_cast<double>(rows)));
  }
  return kept;
}

// The leading modes of F with F = C Omega: F V Lambda^-1/2 with Omega^T F = V Lambda V^T. At most
// `kept`.
Result<MatrixXd> leading_modes(const MatrixXd& omega, const MatrixXd& sketch, int kept) {
  const Eigen::Index tested = omega.cols();
  MatrixXd core(tested, tested);
  linalg::blas::multiply_transposed(1.0, omega, sketch, 0.0, core);
  core = (0.5 * (core + core.transpose())).eval();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(core);
  if (eigen.info() != Eigen::Success || !eigen.eigenvalues().allFinite()) {
    return fail(ErrorCode::kNotFinite, "prior modes: the sketched covariance has no eigenvalues");
  }
  // Below the rounding of the largest eigenvalue a mode is noise.
  const double smallest = 1e-13 * eigen.eigenvalues()[tested - 1];
  Eigen::Index rank = 0;
  while (rank < std::min<Eigen::Index>(kept, tested) &&
         eigen.eigenvalues()[tested - 1 - rank] > smallest) {
    ++rank;
  }
  MatrixXd scaled(tested, rank);
  for (Eigen::Index j = 0; j < rank; ++j) {
    scaled.col(j) =
        eigen.eigenvectors().col(tested - 1 - j) / std::sqrt(eigen.eigenvalues()[tested - 1 - j]);
  }
  MatrixXd modes(sketch.rows(), rank);
  linalg::blas::multiply(1.0, sketch, scaled, 0.0, modes);
  return modes;
}

// Steps 2 and 3: U.
Status prior_modes(const PreparedModel& model, BlockRunner& runner, MatrixXf& all_modes,
                   CondensedOperators& result) {
  const Eigen::Index rows = 3 * model.model().mesh.num_nodes();
  const prior::ForcePrior& prior = model.prior();
  const int loads = prior.num_modes();
  const auto kept = kept_modes(model.config(), loads, rows);
  const int tested = static_cast<int>(
      std::min<Eigen::Index>(*std::max_element(kept.begin(), kept.end()) + kOversampling, rows));

  const MatrixXd omega = test_vectors(result, rows, tested);
  std::array<MatrixXd, kRemainders> sketches;
  for (std::size_t g = 0; g < kept.size(); ++g) {
    if (kept[g] > 0) sketches[g].resize(rows, tested);
  }
  MatrixXd load_columns(rows, loads);
  auto status = runner.run("prior modes", tested, [&](int first, int count, auto& own) -> Status {
    own.loads = omega.middleCols(first, count);
    if (auto solved = own.solver.solve(own.loads, own.solved); !solved) return solved;
    for (int g = 0; g < kRemainders; ++g) {
      if (kept[static_cast<std::size_t>(g)] == 0) continue;
      prior.kernel(g).apply(own.solved, own.forces);
      if (auto solved = own.solver.solve(own.forces, own.loads); !solved) return solved;
      sketches[static_cast<std::size_t>(g)].middleCols(first, count) = own.loads;
    }
    return {};
  });
  if (!status) return status;
  status = runner.run("load modes", loads, [&](int first, int count, auto& own) -> Status {
    own.loads = prior.modes().middleCols(first, count);
    if (auto solved = own.solver.solve(own.loads, own.solved); !solved) return solved;
    load_columns.middleCols(first, count) = own.solved;
    return {};
  });
  if (!status) return status;

  result.part_columns = prior.columns_of_part();
  MatrixXd modes = std::move(load_columns);
  for (std::size_t g = 0; g < kept.size(); ++g) {
    if (kept[g] == 0) continue;
    const auto leading = leading_modes(omega, sketches[g], kept[g]);
    if (!leading) return tl::unexpected(leading.error());
    sketches[g].resize(0, 0);
    result.part_columns[kLoadParts + g] = static_cast<int>(leading->cols());
    modes.conservativeResize(rows, modes.cols() + leading->cols());
    modes.rightCols(leading->cols()) = *leading;
  }
  all_modes = modes.cast<float>();
  result.slave_modes.resize(static_cast<Eigen::Index>(result.slaves.size()), modes.cols());
  for (std::size_t i = 0; i < result.slaves.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    result.slave_modes.row(row) =
        result.slave_normals.col(row).transpose() * modes.middleRows<3>(3 * result.slaves[i]);
  }
  return {};
}

// Step 4: what the modes leave out of the prior variance, at the control nodes.
Status left_out_variance(const PreparedModel& model, BlockRunner& runner, const MatrixXf& modes,
                         CondensedOperators& result) {
  const Points& nodes = model.model().mesh.nodes;
  const std::vector<NodeIndex> spread =
      geometry::spread_nodes(nodes, model.config().condensed.uncertainty_nodes);
  const int probed = std::min<int>(kVarianceNodes, static_cast<int>(spread.size()));
  MatrixXd variance = MatrixXd::Zero(3 * probed, kRemainders);
  auto status =
      runner.run("uncertainty", 3 * probed, [&](int first, int count, auto& own) -> Status {
        own.loads.setZero(nodes.size(), count);
        for (int j = 0; j < count; ++j) {
          const int dof = first + j;
          own.loads(3 * spread[static_cast<std::size_t>(dof / 3)] + dof % 3, j) = 1.0;
        }
        if (auto solved = own.solver.solve(own.loads, own.solved); !solved) return solved;
        for (int g = 0; g < kRemainders; ++g) {
          variance.col(g).segment(first, count) =
              model.prior().kernel(g).variance_along(own.solved);
        }
        return {};
      });
  Points positions(3, probed);
  MatrixXd left_out(probed, kRemainders);
  for (int i = 0; i < probed; ++i) {
    const NodeIndex node = spread[static_cast<std::size_t>(i)];
    for (int g = 0; g < kRemainders; ++g) {
      const auto part = static_cast<PriorPart>(kLoadParts + g);
      const double carried =
          modes.block(3 * node, result.first_column(part), 3, result.columns(part))
              .cast<double>()
              .squaredNorm();
      left_out(i, g) = std::max(0.0, variance.col(g).segment<3>(3 * i).sum() - carried) / 3.0;
    }
    positions.col(i) = nodes.col(node);
  }
  result.control = spread;
  std::sort(result.control.begin(), result.control.end());
  Points control(3, static_cast<Eigen::Index>(spread.size()));
  for (std::size_t i = 0; i < result.control.size(); ++i) {
    control.col(static_cast<Eigen::Index>(i)) = nodes.col(result.control[i]);
  }
  const geometry::Interpolation to_control = geometry::interpolate(positions, control);
  // The largest of the neighbours, except at a probe itself: an error bar must not be too short.
  result.truncated_variance_mm2.setZero(control.cols(), kRemainders);
  for (Eigen::Index i = 0; i < control.cols(); ++i) {
    for (int k = 0; k < 4; ++k) {
      if (to_control.weights(k, i) < kLeastControlWeight) continue;
      const auto neighbour = left_out.row(to_control.neighbours(k, i));
      result.truncated_variance_mm2.row(i) =
          result.truncated_variance_mm2.row(i).cwiseMax(neighbour);
    }
  }
  geometry::Interpolation to_nodes = geometry::interpolate(control, nodes);
  result.control_neighbours = std::move(to_nodes.neighbours);
  result.control_weights = std::move(to_nodes.weights);
  return status;
}

}  // namespace

std::uint64_t condense_memory_bytes(int nodes, int slaves, const CaseConfig& config, int threads) {
  const auto n3 = static_cast<std::uint64_t>(3) * static_cast<std::uint64_t>(nodes);
  const auto s = static_cast<std::uint64_t>(slaves);
  const auto q = static_cast<std::uint64_t>(config.condensed.max_rank) + kOversampling;
  const std::uint64_t blocks = 8 * n3 * kBlock * 6 * static_cast<std::uint64_t>(threads);
  // G, also compact; Phi; test vectors, sketches, modes (double) and modes (float)
  return 6 * n3 * s + 8 * s * s + ((2 + kRemainders) * 8 + 4) * n3 * q + blocks;
}

namespace {

double largest_motion_sd_mm(const MatrixXf& modes) {
  const VecX squares = modes.rowwise().squaredNorm().cast<double>();
  double largest = 0.0;
  for (Eigen::Index i = 0; i + 2 < squares.size(); i += 3) {
    largest = std::max(largest, squares.segment<3>(i).sum());
  }
  return std::sqrt(largest);
}

// Against a prior in other units, or with every part switched off.
Status check_motion(const MatrixXf& modes) {
  constexpr double kMost_mm = 10.0 * kMostMotion_mm;
  const double sd_mm = largest_motion_sd_mm(modes);
  if (sd_mm > 0.0 && sd_mm <= kMost_mm) return {};
  char text[160];
  std::snprintf(text, sizeof text,
                "prior: it allows a node to move by %.3g mm (standard deviation); above 0 and at "
                "most %g mm, ten times what a skull allows",
                sd_mm, kMost_mm);
  return fail(ErrorCode::kInvalidArgument, text);
}

// Rows of [U G] at the given nodes.
MatrixXf region_rows(const std::vector<NodeIndex>& nodes, const MatrixXf& modes,
                     const MatrixXf& columns) {
  MatrixXf rows(3 * static_cast<Eigen::Index>(nodes.size()), modes.cols() + columns.cols());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    auto own = rows.middleRows<3>(3 * static_cast<Eigen::Index>(i));
    own << modes.middleRows<3>(3L * nodes[i]), columns.middleRows<3>(3L * nodes[i]);
  }
  return rows;
}

}  // namespace

double largest_motion_sd_mm(const CondensedOperators& operators) {
  std::vector<NodeIndex> all(static_cast<std::size_t>(operators.num_nodes()));
  std::iota(all.begin(), all.end(), 0);
  ThreadTeam team(1);
  return largest_motion_sd_mm(
      decode_rows(operators.responses, all, column_range(0, operators.num_modes()), team));
}

Result<CondensedOperators> condense(const PreparedModel& model, const CondenseOptions& options) {
  const int slaves = model.forward().contact().num_slaves();
  const int threads = options.threads > 0
                          ? options.threads
                          : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  const int nodes = model.model().mesh.num_nodes();
  const std::uint64_t bytes = condense_memory_bytes(nodes, slaves, model.config(), threads);
  if (auto status = check_memory(model, bytes); !status) return tl::unexpected(status.error());
  CondensedOperators result;
  result.boundary = model.boundary();
  result.model_id = model.model().model_id;
  result.region = data_region(model.model());
  BlockRunner runner(model, options.progress, options.stop, options.threads);
  MatrixXf columns, modes;  // G, U
  if (auto status = contact_columns(model, options, runner, columns, result); !status) {
    return tl::unexpected(status.error());
  }
  if (!result.compliance.allFinite()) {
    return fail(ErrorCode::kNotFinite,
                "contact columns: the compliance of the slaves is not finite");
  }
  if (auto status = prior_modes(model, runner, modes, result); !status) {
    return tl::unexpected(status.error());
  }
  if (auto status = check_motion(modes); !status) return tl::unexpected(status.error());
  if (auto status = left_out_variance(model, runner, modes, result); !status) {
    return tl::unexpected(status.error());
  }
  ThreadTeam team(options.threads);
  auto responses =
      encode_columns(model.model().mesh.nodes, {{&modes, kModeStep}, {&columns, kContactStep}},
                     team, options.progress, options.stop);
  if (!responses) return tl::unexpected(responses.error());
  result.region_responses = region_rows(result.region, modes, columns);
  result.responses = std::move(*responses);
  return result;
}

}  // namespace brainshift::inversion
