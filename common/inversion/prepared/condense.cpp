// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/prepared/condense.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <thread>
#include <vector>

#include "common/core/random.hpp"
#include "common/geometry/node_choice.hpp"
#include "common/linalg/blas.hpp"
#include "common/operators/encode_columns.hpp"
#include "common/values/quality.hpp"

namespace brainshift::inversion {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;

constexpr int kLeastBlock = 24;
// Test vectors beyond the modes that are kept. Far more than the 5 to 10 that Halko et al.
// recommend, because the spectrum falls slowly: 32 left 0.013 mm in a swollen brain with 659 active
// slaves, about 200 left 0.008 mm.
constexpr int kOversampling = 192;
// The far field's modes are not seen by data and need no such care.
constexpr int kOversamplingFar = 64;
// Weight of slaves in the test vectors, against 1 near the data: they matter through contact only.
// On the default head 0.1 halves the error of 0 and of 0.3 (docs/decisions/0008).
constexpr double kSlaveWeight = 0.1;
// Control nodes at which diag(C) is computed; it is smooth, and interpolated to the others.
constexpr int kVarianceNodes = 128;
// A control node with less weight in the interpolation at a node has no say there. At a control
// node its own weight is all but 1.
constexpr float kMinControlWeight = 1e-4F;
constexpr std::uint64_t kSeed = 20091115;  // any fixed number

// Omega: normally distributed near the data and, weaker, along the slaves' normals. 0 at all other
// nodes, which are not kept.
struct TestVectors {
  std::vector<NodeIndex> nodes;  // sorted
  MatrixXd numbers;              // vectors x 3 nodes

  // Vectors [first, first + count) at all nodes.
  void write(int first, int count, Eigen::Index components, MatrixXd& out) const {
    out.setZero(count, components);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      out.middleCols<3>(3L * nodes[i]) =
          numbers.block(first, 3 * static_cast<Eigen::Index>(i), count, 3);
    }
  }
  // The columns of fields at `nodes`.
  MatrixXd columns_of(const MatrixXd& fields) const {
    MatrixXd columns(fields.rows(), numbers.cols());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      columns.middleCols<3>(3 * static_cast<Eigen::Index>(i)) = fields.middleCols<3>(3L * nodes[i]);
    }
    return columns;
  }
};

// region: where they have no weight but 1.
TestVectors test_vectors(const CondensedOperators& operators, const std::vector<NodeIndex>& region,
                         int count) {
  TestVectors omega;
  omega.nodes = region;
  omega.nodes.insert(omega.nodes.end(), operators.slaves.begin(), operators.slaves.end());
  std::sort(omega.nodes.begin(), omega.nodes.end());
  omega.nodes.erase(std::unique(omega.nodes.begin(), omega.nodes.end()), omega.nodes.end());
  const auto place = [&](NodeIndex node) {
    return 3 *
           (std::lower_bound(omega.nodes.begin(), omega.nodes.end(), node) - omega.nodes.begin());
  };
  Random random(kSeed);
  omega.numbers.setZero(count, 3 * static_cast<Eigen::Index>(omega.nodes.size()));
  for (int j = 0; j < count; ++j) {
    auto vector = omega.numbers.row(j);
    for (const NodeIndex node : region) {
      for (int axis = 0; axis < 3; ++axis) vector[place(node) + axis] = random.normal();
    }
    for (std::size_t i = 0; i < operators.slaves.size(); ++i) {
      vector.segment<3>(place(operators.slaves[i])) +=
          kSlaveWeight * random.normal() *
          operators.slave_normals.col(static_cast<Eigen::Index>(i)).transpose();
    }
  }
  return omega;
}

// How many modes each residual field keeps of those that the load families leave of `max_rank`.
std::array<int, kRemainders> kept_modes(const CaseConfig& config, int loads, Eigen::Index rows) {
  // A coarse field needs fewer than a fine one.
  std::array<double, kRemainders> share = {0.3, 0.3, 0.15, 0.55};
  const bool medium = config.prior.medium_density_sd_n_m3 > 0.0;
  const bool coarse = config.prior.coarse_density_sd_n_m3 > 0.0;
  if (config.prior.force_density_sd_n_m3 == 0.0) share[0] = 0.0;
  if (!medium) share[1] = 0.0;
  if (!coarse) share[2] = 0.0;
  if (!medium && !coarse) share[3] = 0.0;
  const double all = share[0] + share[1] + share[2] + share[3];  // 0: no residual field
  const int left = std::max(kRemainders, config.condensed.max_rank - loads);
  std::array<int, kRemainders> kept{};
  for (std::size_t g = 0; g < kept.size(); ++g) {
    if (share[g] == 0.0) continue;
    kept[g] = static_cast<int>(std::clamp(share[g] / all * left, 1.0, static_cast<double>(rows)));
  }
  return kept;
}

// The leading modes of F with F = C Omega: F V Lambda^-1/2 with Omega^T F = V Lambda V^T. At most
// `kept`. sketch, modes: a field per row.
// Of several processes each has its own rows of the sketch.
Result<MatrixXd> leading_modes(const TestVectors& omega, const MatrixXd& sketch, int kept,
                               const BlockRunner& runner) {
  const Eigen::Index tested = omega.numbers.rows();
  const Eigen::Index first = runner.own_first(static_cast<int>(tested));
  MatrixXd core = MatrixXd::Zero(tested, tested);
  linalg::blas::multiply_by_transposed(1.0, omega.numbers, omega.columns_of(sketch), 0.0,
                                       core.middleCols(first, sketch.rows()));
  runner.sum(core);
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
  // The first process chooses: another processor may find other signs, or another noise.
  const bool chooses = runner.ranks() == nullptr || runner.ranks()->rank() == 0;
  VecX chosen = VecX::Constant(1, chooses ? static_cast<double>(rank) : 0.0);
  runner.sum(chosen);
  rank = static_cast<Eigen::Index>(chosen[0]);
  MatrixXd scaled(tested, rank);
  for (Eigen::Index j = 0; j < rank; ++j) {
    scaled.col(j) =
        eigen.eigenvectors().col(tested - 1 - j) / std::sqrt(eigen.eigenvalues()[tested - 1 - j]);
  }
  if (!chooses) scaled.setZero();
  runner.sum(scaled);
  MatrixXd modes(rank, sketch.cols());
  linalg::blas::multiply_transposed(1.0, scaled.middleRows(first, sketch.rows()), sketch, 0.0,
                                    modes);
  runner.sum(modes);
  return modes;
}

// Puts displacement fields, one per row, behind the modes that are there.
void append_modes(const MatrixXd& fields, MatrixXf& modes, CondensedOperators& result) {
  const Eigen::Index before = modes.cols();
  modes.conservativeResize(fields.cols(), before + fields.rows());
  modes.rightCols(fields.rows()) = fields.transpose().cast<float>();
  result.slave_modes.conservativeResize(static_cast<Eigen::Index>(result.slaves.size()),
                                        modes.cols());
  for (std::size_t i = 0; i < result.slaves.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    result.slave_modes.row(row).tail(fields.rows()) =
        (fields.middleCols<3>(3L * result.slaves[i]) * result.slave_normals.col(row)).transpose();
  }
}

constexpr double kGib = 1024.0 * 1024.0 * 1024.0;

// Before anything is allocated.
Status check_memory(const PreparedModel& model, std::uint64_t bytes) {
  const double limit_gib = model.config().condensed.memory_limit_gib;
  const double needed_gib = static_cast<double>(bytes) / kGib;
  if (needed_gib <= limit_gib) return {};
  return invalid(fmt::format(
      "condensed.memory_limit_gib = {:.3g}: the preparation needs {:.3g} GiB ({} slaves, "
      "{} nodes); raise the limit or coarsen the mesh",
      limit_gib, needed_gib, model.forward().contact().num_slaves(),
      model.model().mesh.num_nodes()));
}

// Steps 1 and 2: U. one_field_at_a_time: of the near fields' sketches only one is there at a time,
// and their test vectors are solved once for each.
Status prior_modes(const PreparedModel& model, BlockRunner& runner, bool one_field_at_a_time,
                   MatrixXf& modes, CondensedOperators& result) {
  const Eigen::Index rows = 3 * model.model().mesh.num_nodes();
  const prior::ForcePrior& prior = model.prior();
  const int loads = prior.num_modes();
  const auto kept = kept_modes(model.config(), loads, rows);
  constexpr std::size_t kFarField = kRemainders - 1;
  const auto tested_for = [&](int most, int oversampling) {
    return static_cast<int>(std::min<Eigen::Index>(most + oversampling, rows));
  };
  const int tested =
      tested_for(*std::max_element(kept.begin(), kept.begin() + kFarField), kOversampling);
  const int tested_far = kept[kFarField] > 0 ? tested_for(kept[kFarField], kOversamplingFar) : 0;

  MatrixXd load_modes = MatrixXd::Zero(loads, rows);
  auto status = runner.run("load modes", loads, [&](int first, int count, auto& own) -> Status {
    own.loads = prior.modes().middleCols(first, count).transpose();
    if (auto solved = own.solver.solve(own.loads, own.solved); !solved) return solved;
    load_modes.middleRows(first, count) = own.solved;
    return {};
  });
  if (!status) return status;
  runner.sum(load_modes);
  append_modes(load_modes, modes, result);
  load_modes.resize(0, 0);

  const TestVectors omega = test_vectors(result, result.region, tested);
  const std::vector<NodeIndex> everywhere =
      geometry::spread_nodes(model.model().mesh.nodes, model.config().condensed.uncertainty_nodes);
  const TestVectors omega_far = test_vectors(result, everywhere, tested_far);
  // The modes of some fields that share their test vectors.
  const auto modes_of = [&](std::string_view stage, const TestVectors& vectors,
                            std::span<const std::size_t> fields) -> Status {
    const auto count_of = static_cast<int>(vectors.numbers.rows());
    const int before = runner.own_first(count_of);
    std::vector<MatrixXd> sketches(fields.size());
    for (MatrixXd& sketch : sketches) sketch.resize(runner.own_count(count_of), rows);
    auto ran = runner.run(stage, count_of, [&](int first, int count, auto& own) -> Status {
      vectors.write(first, count, rows, own.loads);
      if (auto solved = own.solver.solve(own.loads, own.solved); !solved) return solved;
      for (std::size_t f = 0; f < fields.size(); ++f) {
        own.loads.resize(count, rows);
        if (count > 0) prior.kernel(static_cast<int>(fields[f])).apply(own.solved, own.loads);
        if (auto solved = own.solver.solve(own.loads, own.loads); !solved) return solved;
        sketches[f].middleRows(first - before, count) = own.loads;
      }
      return {};
    });
    if (!ran) return ran;
    for (std::size_t f = 0; f < fields.size(); ++f) {
      const std::size_t g = fields[f];
      const auto leading = leading_modes(vectors, sketches[f], kept[g], runner);
      if (!leading) return tl::unexpected(leading.error());
      sketches[f].resize(0, 0);
      result.part_columns[kLoadParts + g] = static_cast<int>(leading->rows());
      append_modes(*leading, modes, result);
    }
    return {};
  };
  result.part_columns = prior.columns_of_part();
  std::vector<std::size_t> near;
  for (std::size_t g = 0; g < kFarField; ++g) {
    if (kept[g] > 0) near.push_back(g);
  }
  const std::size_t together = one_field_at_a_time ? 1 : near.size();
  for (std::size_t first = 0; status && first < near.size(); first += together) {
    status = modes_of("prior modes", omega, std::span(near).subspan(first, together));
  }
  constexpr std::array far = {kFarField};
  if (status && kept[kFarField] > 0) status = modes_of("far modes", omega_far, far);
  return status;
}

// Neighbours are solved together (contact_columns.hpp says why).
void bring_neighbours_together(const Points& nodes, std::span<NodeIndex> some) {
  const std::vector<NodeIndex> before(some.begin(), some.end());
  const SpatialBlocks blocks =
      spatial_blocks(nodes(Eigen::all, before), std::max(1, BlockRunner::kBlock / 3));
  for (std::size_t i = 0; i < some.size(); ++i) {
    some[i] = before[static_cast<std::size_t>(blocks.order[i])];
  }
}

// Step 3: what the modes leave out of the prior variance, at the control nodes.
Status left_out_variance(const PreparedModel& model, BlockRunner& runner, const MatrixXf& modes,
                         CondensedOperators& result) {
  const Points& nodes = model.model().mesh.nodes;
  std::vector<NodeIndex> spread =
      geometry::spread_nodes(nodes, model.config().condensed.uncertainty_nodes);
  const int probed = std::min<int>(kVarianceNodes, static_cast<int>(spread.size()));
  bring_neighbours_together(nodes, std::span(spread).first(static_cast<std::size_t>(probed)));
  MatrixXd variance = MatrixXd::Zero(3 * probed, kRemainders);
  auto status =
      runner.run("uncertainty", 3 * probed, [&](int first, int count, auto& own) -> Status {
        own.loads.setZero(count, nodes.size());
        for (int j = 0; j < count; ++j) {
          const int dof = first + j;
          own.loads(j, 3 * spread[static_cast<std::size_t>(dof / 3)] + dof % 3) = 1.0;
        }
        if (auto solved = own.solver.solve(own.loads, own.solved); !solved) return solved;
        for (int g = 0; g < kRemainders; ++g) {
          if (count == 0 || result.columns(static_cast<PriorPart>(kLoadParts + g)) == 0) continue;
          variance.col(g).segment(first, count) =
              model.prior().kernel(g).variance_along(own.solved);
        }
        return {};
      });
  runner.sum(variance);
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
      if (to_control.weights(k, i) < kMinControlWeight) continue;
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
  constexpr double kMax_mm = 10.0 * kMaxMotion_mm;
  const double sd_mm = largest_motion_sd_mm(modes);
  if (sd_mm > 0.0 && sd_mm <= kMax_mm) return {};
  return invalid(fmt::format(
      "prior: it allows a node to move by {:.3g} mm (standard deviation); above 0 and at "
      "most {:g} mm, ten times what a skull allows",
      sd_mm, kMax_mm));
}

// Keeps the rows of the data region as a group is read: columns [first, first + count) of
// region_responses. Every node is read once, so that threads write to different places.
ColumnGroup keeping_region(ColumnGroup group, Eigen::Index first, CondensedOperators& result) {
  group.rows = [read = std::move(group.rows), first, count = group.count, &result](
                   std::span<const NodeIndex> nodes, Eigen::Index place, MatrixXf& rows) -> Status {
    if (auto status = read(nodes, place, rows); !status) return status;
    const auto& region = result.region;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const auto found = std::lower_bound(region.begin(), region.end(), nodes[i]);
      if (found == region.end() || *found != nodes[i]) continue;
      result.region_responses.block(3 * (found - region.begin()), first, 3, count) =
          rows.middleRows<3>(3 * static_cast<Eigen::Index>(i));
    }
    return {};
  };
  return group;
}

// All that is solved with the factor.
struct Solved {
  CondensedOperators operators;  // without responses
  SpatialBlocks nodes;
  MatrixXf modes;
  ContactColumns contact;
  Ranks* ranks = nullptr;
};

int threads_of(const CondenseOptions& options) {
  return options.threads > 0 ? options.threads
                             : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

Result<Solved> solve(const PreparedModel& model, const CondenseOptions& options, bool free_model) {
  CondenseSizes sizes;
  sizes.nodes = model.model().mesh.num_nodes();
  sizes.slaves = model.forward().contact().num_slaves();
  Solved solved;
  solved.ranks = model.ranks();
  CondensedOperators& result = solved.operators;
  result.boundary = model.boundary();
  result.model_id = model.model().model_id;
  result.region = data_region(model.model());
  sizes.region = static_cast<int>(result.region.size());
  sizes.modes = model.config().condensed.max_rank;
  sizes.threads = threads_of(options);
  sizes.model_bytes = model.timings().bytes;
  sizes.ranks = model.ranks() != nullptr ? model.ranks()->size() : 1;
  sizes.model_stays = !free_model;
  sizes.columns_in_memory = !options.store.keeps();
  const auto limit = static_cast<std::uint64_t>(model.config().condensed.memory_limit_gib * kGib);
  sizes = within_memory(sizes, limit);
  BlockRunner runner(model, options.progress, options.stop, options.threads, sizes.block);
  if (auto ok = runner.agree(check_memory(model, condense_memory_bytes(sizes))); !ok) {
    return tl::unexpected(ok.error());
  }
  solved.nodes = node_blocks(model.model().mesh.nodes);
  add_slaves(model, result);
  // The modes first: the test vectors are gone before the first column is there.
  if (auto status = prior_modes(model, runner, sizes.one_field_at_a_time, solved.modes, result);
      !status) {
    return tl::unexpected(status.error());
  }
  if (auto status = check_motion(solved.modes); !status) return tl::unexpected(status.error());
  if (auto status = left_out_variance(model, runner, solved.modes, result); !status) {
    return tl::unexpected(status.error());
  }
  auto columns = solve_contact_columns(model, solved.nodes, options.store, runner, result);
  if (!columns) return tl::unexpected(columns.error());
  solved.contact = std::move(*columns);
  return solved;
}

Result<CondensedOperators> make_compact(Result<Solved> solved, const CondenseOptions& options) {
  if (!solved) return tl::unexpected(solved.error());
  CondensedOperators& result = solved->operators;
  const Eigen::Index modes = solved->modes.cols();
  const auto slaves = static_cast<Eigen::Index>(result.slaves.size());
  result.region_responses.setZero(3 * static_cast<Eigen::Index>(result.region.size()),
                                  modes + slaves);
  ThreadTeam team(solved->ranks != nullptr ? 1 : options.threads);
  auto responses =
      encode_columns(solved->nodes,
                     {keeping_region(group_of(solved->modes, kModeStep), 0, result),
                      keeping_region(solved->contact.group(kContactStep), modes, result)},
                     team, options.progress, options.stop, solved->ranks);
  if (!responses) return tl::unexpected(responses.error());
  result.responses = std::move(*responses);
  if (solved->ranks != nullptr) {
    auto& rows = result.region_responses;
    solved->ranks->sum(std::span(rows.data(), static_cast<std::size_t>(rows.size())));
  }
  return std::move(result);
}

}  // namespace

std::uint64_t condense_memory_bytes(const CondenseSizes& sizes) {
  const auto of = [](int count) { return static_cast<std::uint64_t>(count); };
  const std::uint64_t rows = 3 * of(sizes.nodes), s = of(sizes.slaves), m = of(sizes.modes);
  const std::uint64_t tested = m / 2 + kOversampling;
  const std::uint64_t ranks = of(sizes.ranks);
  const std::uint64_t columns = sizes.columns_in_memory ? 4 * rows * s / ranks : 0;
  // Two matrices of a member, three of its solver.
  const std::uint64_t blocks = 5 * 8 * rows * of(sizes.block) * of(sizes.threads);
  const std::uint64_t modes = 4 * rows * m, compliance = 8 * s * s;
  // Three residual fields, as the default case has them; the fourth is rare.
  const std::uint64_t fields = sizes.one_field_at_a_time ? 1 : 3;
  const std::uint64_t sketches = 8 * tested * (fields * rows / ranks + 3 * (of(sizes.region) + s));
  const std::uint64_t solving =
      sizes.model_bytes + modes + blocks + std::max(sketches, compliance + columns);
  // Compact columns take 1.5 bytes a number in coarse meshes and less in fine ones, also while they
  // are joined: every part is freed once it is copied.
  const std::uint64_t compact = 3 * rows * (s + m) / 2, region = 4 * 3 * of(sizes.region) * (s + m);
  const std::uint64_t packing =
      (sizes.model_stays ? sizes.model_bytes : 0) + modes + compliance + columns + compact + region;
  return std::max(solving, packing);
}

CondenseSizes within_memory(CondenseSizes sizes, std::uint64_t limit_bytes) {
  if (sizes.ranks > 1 || condense_memory_bytes(sizes) <= limit_bytes) return sizes;
  sizes.one_field_at_a_time = true;
  while (condense_memory_bytes(sizes) > limit_bytes && sizes.block > kLeastBlock) sizes.block /= 2;
  return sizes;
}

double largest_motion_sd_mm(const CondensedOperators& operators) {
  std::vector<NodeIndex> all(static_cast<std::size_t>(operators.num_nodes()));
  std::iota(all.begin(), all.end(), 0);
  ThreadTeam team(1);
  return largest_motion_sd_mm(
      decode_rows(operators.responses, all, column_range(0, operators.num_modes()), team));
}

Result<CondensedOperators> condense(const PreparedModel& model, const CondenseOptions& options) {
  return make_compact(solve(model, options, false), options);
}

Result<CondensedOperators> condense(PreparedModel&& model, const CondenseOptions& options) {
  auto solved = solve(model, options, true);
  { const PreparedModel gone = std::move(model); }
  return make_compact(std::move(solved), options);
}

}  // namespace brainshift::inversion
