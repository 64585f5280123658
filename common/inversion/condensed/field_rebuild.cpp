// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/field_rebuild.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/linalg/column_sums.hpp"
#include "common/operators/encode_columns.hpp"

namespace brainshift::inversion {
namespace {

// Columns of a triangular factor that are multiplied at once.
constexpr Eigen::Index kTogether = 48;

// Variance of each node's interpolation error under the prior, mm^2.
VecX interpolation_variance(const CondensedOperators& operators, ModeWindow window,
                            ThreadTeam& team) {
  std::vector<NodeIndex> all(static_cast<std::size_t>(operators.num_nodes()));
  std::iota(all.begin(), all.end(), 0);
  const Eigen::MatrixXf modes =
      decode_rows(operators.responses, all, column_range(window.first, window.count), team);
  VecX variance = VecX::Zero(operators.num_nodes());
  for (int j = 0; j < window.count; ++j) {
    const auto mode = modes.col(j);
    for (int i = 0; i < operators.num_nodes(); ++i) {
      Eigen::Vector3f error = mode.segment<3>(3 * i);
      for (int c = 0; c < 4; ++c) {
        const NodeIndex from =
            operators.control[static_cast<std::size_t>(operators.control_neighbours(c, i))];
        error -= operators.control_weights(c, i) * mode.segment<3>(3 * from);
      }
      variance[i] += static_cast<double>(error.squaredNorm());
    }
  }
  return variance;
}

bool same_neighbours(const CondensedOperators& operators, NodeIndex a, NodeIndex b) {
  return operators.control_neighbours.col(a) == operators.control_neighbours.col(b);
}

// region: sorted nodes that must be exact; empty: every node, and the result is empty.
FarField plan_far_field(const CondensedOperators& operators, ModeWindow window,
                        const std::vector<NodeIndex>& region, ThreadTeam& team) {
  FarField plan;
  if (region.empty()) return plan;
  const auto nodes = static_cast<std::size_t>(operators.num_nodes());
  std::vector<char> exact(nodes, 0);
  for (const NodeIndex node : region) exact[static_cast<std::size_t>(node)] = 1;
  for (const NodeIndex node : operators.control) exact[static_cast<std::size_t>(node)] = 1;

  const VecX variance = interpolation_variance(operators, window, team);
  std::vector<NodeIndex> worst(nodes);
  std::iota(worst.begin(), worst.end(), 0);
  std::stable_sort(worst.begin(), worst.end(),
                   [&](NodeIndex a, NodeIndex b) { return variance[a] > variance[b]; });
  for (const NodeIndex node : worst) {
    if (plan.probes.size() == kProbes) break;
    if (exact[static_cast<std::size_t>(node)]) continue;
    // Nodes between the same control nodes tell the same.
    if (std::none_of(plan.probes.begin(), plan.probes.end(),
                     [&](NodeIndex probe) { return same_neighbours(operators, probe, node); })) {
      plan.probes.push_back(node);
    }
  }
  for (const NodeIndex node : plan.probes) exact[static_cast<std::size_t>(node)] = 1;

  plan.row.assign(nodes, -1);
  for (std::size_t i = 0; i < nodes; ++i) {
    if (!exact[i]) continue;
    plan.row[i] = static_cast<int>(plan.rebuilt.size());
    plan.rebuilt.push_back(static_cast<NodeIndex>(i));
  }
  for (std::size_t i = 0; i < operators.slaves.size(); ++i) {
    if (plan.row[static_cast<std::size_t>(operators.slaves[i])] < 0) {
      plan.far_slaves.push_back(static_cast<int>(i));
    }
  }
  return plan;
}

// out_i = sum over j of weight_j a_ij^2; without weights they are 1.
void sum_squares(const Eigen::Ref<const Eigen::MatrixXf, 0, Eigen::OuterStride<>>& a,
                 const float* weight, Eigen::Ref<Eigen::VectorXf> out) {
  out.setZero();
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    out.array() += (weight != nullptr ? weight[j] : 1.0F) * a.col(j).array().square();
  }
}

}  // namespace

FieldRebuild::FieldRebuild(const CondensedOperators& operators, ModeWindow window, ThreadTeam& team,
                           const std::vector<NodeIndex>& region)
    : operators_(operators),
      window_(window),
      far_(plan_far_field(operators, window, region, team)),
      control_modes_(decode_rows(operators.responses, operators.control,
                                 column_range(0, operators.num_modes()), team)),
      control_contact_(
          decode_rows(operators.responses, operators.control,
                      column_range(operators.contact_column(0), operators.num_slaves()), team)),
      response_(operators.num_slaves(), window.count),
      factor_(window.count, window.count),
      conditioned_(control_modes_.rows(), window.count),
      spread_(control_modes_.rows(), window.count),
      explained_(new float[static_cast<std::size_t>(
          window.count * (window.count + Eigen::Index{SparseData::kMaxCommonErrors}))]),
      seen_(new float[static_cast<std::size_t>(
          control_modes_.rows() * (window.count + Eigen::Index{SparseData::kMaxCommonErrors}))]),
      contact_storage_(new float[static_cast<std::size_t>(control_contact_.size())]),
      control_variance_(static_cast<Eigen::Index>(operators.control.size())),
      control_known_(control_variance_.size()) {
  squares_.resize(control_modes_.rows());
  prior_at_.resize(control_modes_.rows());
  const auto most =
      static_cast<std::size_t>(window.count) + static_cast<std::size_t>(operators.num_slaves());
  terms_.reserve(most);
  const CompactColumns& responses = operators.responses;
  has_block_.assign(static_cast<std::size_t>(responses.num_blocks()), far_.empty() ? 1 : 0);
  for (const NodeIndex node : region) {
    has_block_[static_cast<std::size_t>(responses.place(node).block)] = 1;
  }
  for (int b = 0; b < responses.num_blocks(); ++b) {
    if (has_block_[static_cast<std::size_t>(b)]) blocks_.push_back(b);
  }
  some_blocks_.reserve(has_block_.size());
  std::vector<NodeIndex> spare;
  for (const NodeIndex node : far_.rebuilt) {
    const bool summed = has_block_[static_cast<std::size_t>(responses.place(node).block)];
    place_.push_back(summed ? place(node)
                            : 3 * static_cast<Eigen::Index>(operators.num_nodes() + spare.size()));
    if (!summed) spare.push_back(node);
  }
  field_.resize(3 * static_cast<Eigen::Index>(operators.num_nodes() + spare.size()));
  if (spare.empty()) return;
  columns_.reserve(most);
  factors_.reserve(most);
  spare_modes_ = decode_rows(responses, spare, column_range(0, operators.num_modes()), team);
  spare_contact_ = decode_rows(
      responses, spare, column_range(operators.contact_column(0), operators.num_slaves()), team);
}

Eigen::Index FieldRebuild::place(NodeIndex node) const {
  const CompactColumns::Place at = operators_.responses.place(node);
  return 3 * static_cast<Eigen::Index>(operators_.responses.first_node(at.block) + at.node);
}

void FieldRebuild::gather_terms(const VecX& z, const ContactAtLoads& contact) {
  terms_.clear();
  columns_.clear();
  factors_.clear();
  const bool spare = spare_modes_.rows() > 0;
  for (int j = 0; j < window_.count; ++j) {
    terms_.push_back({window_.first + j, static_cast<float>(z[j])});
    if (spare) columns_.push_back(spare_modes_.col(window_.first + j).data());
    if (spare) factors_.push_back(static_cast<float>(z[j]));
  }
  for (int j = 0; j < contact.size(); ++j) {
    const int slave = contact.active()[static_cast<std::size_t>(j)];
    const auto force = static_cast<float>(contact.forces()[j]);
    terms_.push_back({operators_.contact_column(slave), force});
    if (spare) columns_.push_back(spare_contact_.col(slave).data());
    if (spare) factors_.push_back(force);
  }
}

void FieldRebuild::sum_blocks(ThreadTeam& team, const std::vector<int>& blocks, float omitted_mm) {
  team.split(static_cast<long>(blocks.size()), [&](long begin, long end) {
    for (long i = begin; i < end; ++i) {
      const int block = blocks[static_cast<std::size_t>(i)];
      operators_.responses.sum(
          block, terms_, field_.data() + 3L * operators_.responses.first_node(block), omitted_mm);
    }
  });
}

void FieldRebuild::sum_spare(ThreadTeam& team) {
  const long start = 3L * operators_.num_nodes();
  team.split(spare_modes_.rows(), [&](long begin, long end) {
    float* out = field_.data() + start + begin;
    std::fill(out, out + (end - begin), 0.0F);
    linalg::add_columns(columns_.data(), factors_.data(), columns_.size(), begin, end - begin, out);
  });
}

void FieldRebuild::displacement_at(ThreadTeam& team, const std::vector<NodeIndex>& nodes,
                                   const VecX& z, const ContactAtLoads& contact, Points& u) {
  u.resize(3, static_cast<Eigen::Index>(nodes.size()));
  gather_terms(z, contact);
  std::fill(has_block_.begin(), has_block_.end(), char{0});
  some_blocks_.clear();
  for (const NodeIndex node : nodes) {
    const int block = operators_.responses.place(node).block;
    char& has = has_block_[static_cast<std::size_t>(block)];
    if (!has) some_blocks_.push_back(block);
    has = 1;
  }
  sum_blocks(team, some_blocks_, 0.0F);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    u.col(static_cast<Eigen::Index>(i)) = field_.segment<3>(place(nodes[i])).cast<double>();
  }
}

void FieldRebuild::displacement(ThreadTeam& team, const VecX& z, const ContactAtLoads& contact,
                                Points& u) {
  u.resize(3, operators_.num_nodes());
  gather_terms(z, contact);
  sum_blocks(team, blocks_, kOmitted_mm);
  far_field_error_mm_ = 0.0;
  if (!far_.empty()) {
    sum_spare(team);
    return interpolate_far(team, contact, u);
  }
  team.split(u.cols(), [&](long begin, long end) {
    for (long i = begin; i < end; ++i) {
      u.col(i) = field_.segment<3>(place(static_cast<NodeIndex>(i))).cast<double>();
    }
  });
}

Vec3 FieldRebuild::interpolated(NodeIndex node) const {
  Vec3 u = Vec3::Zero();
  for (int c = 0; c < 4; ++c) {
    const NodeIndex from =
        operators_.control[static_cast<std::size_t>(operators_.control_neighbours(c, node))];
    u += static_cast<double>(operators_.control_weights(c, node)) *
         field_
             .segment<3>(place_[static_cast<std::size_t>(far_.row[static_cast<std::size_t>(from)])])
             .cast<double>();
  }
  return u;
}

void FieldRebuild::interpolate_far(ThreadTeam& team, const ContactAtLoads& contact, Points& u) {
  team.split(u.cols(), [&](long begin, long end) {
    for (long i = begin; i < end; ++i) {
      const int row = far_.row[static_cast<std::size_t>(i)];
      if (row >= 0) {
        u.col(i) = field_.segment<3>(place_[static_cast<std::size_t>(row)]).cast<double>();
      } else {
        u.col(i) = interpolated(static_cast<NodeIndex>(i));
      }
    }
  });
  double worst = 0.0;
  for (const NodeIndex probe : far_.probes) {
    worst = std::max(worst, (u.col(probe) - interpolated(probe)).norm());
  }
  for (const int slave : far_.far_slaves) {
    const double exact =
        operators_.initial_penetration_mm[slave] - contact.penetration()[slave];  // N . u
    const NodeIndex node = operators_.slaves[static_cast<std::size_t>(slave)];
    worst = std::max(worst, std::abs(operators_.slave_normals.col(slave).dot(u.col(node)) - exact));
  }
  far_field_error_mm_ = kFarFieldSafety * worst;
}

double FieldRebuild::greatest_control_move(const VecX& dg, const VecX& dz,
                                           const ContactReduction& contact, const VecX& df) const {
  Eigen::VectorXf move = control_modes_.leftCols(window_.first) * dg.cast<float>();
  move += control_modes_.middleCols(window_.first, window_.count) * dz.cast<float>();
  for (int j = 0; j < contact.size(); ++j) {
    move += static_cast<float>(df[j]) *
            control_contact_.col(contact.active()[static_cast<std::size_t>(j)]);
  }
  float worst = 0.0F;
  for (Eigen::Index i = 0; i < move.size(); i += 3) {
    worst = std::max(worst, move.segment<3>(i).norm());
  }
  return static_cast<double>(worst);
}

void FieldRebuild::standard_deviation(ThreadTeam& team, const ContactReduction& contact,
                                      const linalg::blas::In<double>& covariance_factor,
                                      const RemainderVariances& left_out, VecX& sd) {
  const int r = window_.count, k = contact.size();
  sd.resize(operators_.num_nodes());
  // Single precision is exact enough for a standard deviation.
  factor_.setZero(r, r);
  factor_.triangularView<Eigen::Lower>() = covariance_factor.cast<float>();
  Eigen::Map<Eigen::MatrixXf> response(response_.data(), k, r);
  if (k > 0) response = contact.response().leftCols(r).cast<float>();
  Eigen::Map<Eigen::MatrixXf> columns(contact_storage_.get(), control_contact_.rows(), k);
  team.split(static_cast<long>(operators_.control.size()), [&](long begin, long end) {
    const Eigen::Index first = 3 * begin, rows = 3 * (end - begin);
    auto v = conditioned_.middleRows(first, rows);
    v = control_modes_.block(first, window_.first, rows, r);
    if (k > 0) {
      auto own = columns.middleRows(first, rows);
      for (int j = 0; j < k; ++j) {
        own.col(j) = control_contact_.col(contact.active()[static_cast<std::size_t>(j)])
                         .segment(first, rows);
      }
      linalg::blas::multiply(-1.0F, own, response, 1.0F, v);
    }
    for (Eigen::Index col = 0; col < r; col += kTogether) {  // F has nothing above its diagonal
      const Eigen::Index count = std::min<Eigen::Index>(kTogether, r - col);
      linalg::blas::multiply(1.0F, v.rightCols(r - col), factor_.block(col, col, r - col, count),
                             0.0F, spread_.block(first, col, rows, count));
    }
    sum_squares(spread_.middleRows(first, rows), nullptr, squares_.segment(first, rows));
    for (long i = begin; i < end; ++i) {
      control_variance_[i] = static_cast<double>(squares_.segment<3>(3 * i).sum()) / 3.0 +
                             operators_.truncated_variance_mm2.row(i).dot(left_out);
    }
  });
  interpolate(team, control_variance_, sd);
  sd = sd.cwiseSqrt();
}

void FieldRebuild::interpolate(ThreadTeam& team, const VecX& at_control, VecX& out) const {
  team.split(out.size(), [&](long begin, long end) {
    for (long i = begin; i < end; ++i) {
      double value = 0.0;
      for (int c = 0; c < 4; ++c) {
        value += static_cast<double>(operators_.control_weights(c, i)) *
                 at_control[operators_.control_neighbours(c, i)];
      }
      out[i] = value;
    }
  });
}

void FieldRebuild::known(ThreadTeam& team, const linalg::blas::In<double>& explained,
                         const VecX& variances, VecX& known) {
  const Eigen::Index r = window_.count, k = explained.rows();
  known.resize(operators_.num_nodes());
  Eigen::Map<Eigen::MatrixXf> x(explained_.get(), r, k);
  x = explained.transpose().cast<float>();
  Eigen::Map<Eigen::MatrixXf> seen(seen_.get(), conditioned_.rows(), k);
  prior_squares_ = variances.cast<float>();
  team.split(static_cast<long>(operators_.control.size()), [&](long begin, long end) {
    const Eigen::Index first = 3 * begin, rows = 3 * (end - begin);
    const auto v = conditioned_.middleRows(first, rows);
    if (k > 0) linalg::blas::multiply(1.0F, v, x, 0.0F, seen.middleRows(first, rows));
    sum_squares(v, prior_squares_.data(), prior_at_.segment(first, rows));
    sum_squares(seen.middleRows(first, rows), nullptr, squares_.segment(first, rows));
    for (long i = begin; i < end; ++i) {
      const double all = static_cast<double>(prior_at_.segment<3>(3 * i).sum()) +
                         3.0 * operators_.truncated_variance_mm2.row(i).sum();
      const double taken = static_cast<double>(squares_.segment<3>(3 * i).sum());
      control_known_[i] =
          all > 0.0 ? 1.0 - std::sqrt(std::clamp(1.0 - taken / all, 0.0, 1.0)) : 0.0;
    }
  });
  interpolate(team, control_known_, known);
}

}  // namespace brainshift::inversion
