// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/field_rebuild.hpp"

#include <algorithm>
#include <cmath>

#include "common/inversion/condensed/gather_rows.hpp"
#include "common/linalg/blas.hpp"

namespace brainshift::inversion {
namespace {

// Rows summed at a time: 16 KB of the result, which stays in the first cache while columns stream
// past.
constexpr long kChunk = 4096;

// out += sum over j of factor[j] column[j], for `rows` numbers from `first` on. Plain loops in the
// place of BLAS: its kernels round the last numbers of an array otherwise than the others, so that
// a node's sum would depend on where it stands; and four columns in one pass take less time than
// four passes.
void add_columns(const std::vector<const float*>& column, const std::vector<float>& factor,
                 long first, long rows, float* __restrict out) {
  std::size_t j = 0;
  for (; j + 4 <= column.size(); j += 4) {
    const float *a = column[j] + first, *b = column[j + 1] + first, *c = column[j + 2] + first,
                *d = column[j + 3] + first;
    const float fa = factor[j], fb = factor[j + 1], fc = factor[j + 2], fd = factor[j + 3];
    for (long i = 0; i < rows; ++i) {
      out[i] = (((out[i] + fa * a[i]) + fb * b[i]) + fc * c[i]) + fd * d[i];
    }
  }
  for (; j < column.size(); ++j) {
    const float* a = column[j] + first;
    const float fa = factor[j];
    for (long i = 0; i < rows; ++i) out[i] += fa * a[i];
  }
}

}  // namespace

FieldRebuild::FieldRebuild(const CondensedOperators& operators, ModeWindow window,
                           const std::vector<NodeIndex>& region)
    : operators_(operators),
      window_(window),
      far_(plan_far_field(operators, window, region)),
      field_(far_.empty() ? operators.modes.rows()
                          : 3 * static_cast<Eigen::Index>(far_.rebuilt.size())),
      control_modes_(gather_rows(operators.modes, operators.control)),
      control_contact_(gather_rows(operators.contact_columns, operators.control)),
      response_(operators.num_slaves(), window.count),
      factor_(window.count, window.count),
      conditioned_(control_modes_.rows(), window.count),
      spread_(control_modes_.rows(), window.count),
      contact_storage_(new float[static_cast<std::size_t>(control_contact_.size())]),
      control_variance_(static_cast<Eigen::Index>(operators.control.size())) {
  const auto most =
      static_cast<std::size_t>(window.count) + static_cast<std::size_t>(operators.num_slaves());
  columns_.reserve(most);
  factors_.reserve(most);
  if (far_.empty()) return;
  near_modes_ = gather_rows(operators.modes, far_.rebuilt);
  near_contact_ = gather_rows(operators.contact_columns, far_.rebuilt);
}

void FieldRebuild::sum_columns(ThreadTeam& team, const VecX& z, const ContactAtLoads& contact) {
  const Eigen::MatrixXf& modes = far_.empty() ? operators_.modes : near_modes_;
  const Eigen::MatrixXf& contacts = far_.empty() ? operators_.contact_columns : near_contact_;
  columns_.clear();
  factors_.clear();
  for (int j = 0; j < window_.count; ++j) {
    columns_.push_back(modes.col(window_.first + j).data());
    factors_.push_back(static_cast<float>(z[j]));
  }
  for (int j = 0; j < contact.size(); ++j) {
    columns_.push_back(contacts.col(contact.active()[static_cast<std::size_t>(j)]).data());
    factors_.push_back(static_cast<float>(contact.forces()[j]));
  }
  team.split(field_.size(), [&](long begin, long end) {
    for (long first = begin; first < end; first += kChunk) {
      const long rows = std::min(kChunk, end - first);
      float* out = field_.data() + first;
      std::fill(out, out + rows, 0.0F);
      add_columns(columns_, factors_, first, rows, out);
    }
  });
}

void FieldRebuild::displacement_at(ThreadTeam& team, const std::vector<NodeIndex>& nodes,
                                   const VecX& z, const ContactAtLoads& contact, Points& u) const {
  u.setZero(3, static_cast<Eigen::Index>(nodes.size()));
  team.split(u.cols(), [&](long begin, long end) {
    const auto add = [&](const auto& column, double factor) {
      for (long i = begin; i < end; ++i) {
        const NodeIndex node = nodes[static_cast<std::size_t>(i)];
        u.col(i) += factor * column.template segment<3>(3L * node).template cast<double>();
      }
    };
    for (int j = 0; j < window_.count; ++j) add(operators_.modes.col(window_.first + j), z[j]);
    for (int j = 0; j < contact.size(); ++j) {
      add(operators_.contact_columns.col(contact.active()[static_cast<std::size_t>(j)]),
          contact.forces()[j]);
    }
  });
}

void FieldRebuild::displacement(ThreadTeam& team, const VecX& z, const ContactAtLoads& contact,
                                Points& u) {
  u.resize(3, operators_.num_nodes());
  sum_columns(team, z, contact);
  far_field_error_mm_ = 0.0;
  if (!far_.empty()) return interpolate_far(team, contact, u);
  team.split(field_.size(), [&](long begin, long end) {
    for (long i = begin; i < end; ++i) u.data()[i] = static_cast<double>(field_[i]);
  });
}

Vec3 FieldRebuild::interpolated(NodeIndex node) const {
  Vec3 u = Vec3::Zero();
  for (int c = 0; c < 4; ++c) {
    const NodeIndex from =
        operators_.control[static_cast<std::size_t>(operators_.control_neighbours(c, node))];
    u += static_cast<double>(operators_.control_weights(c, node)) *
         field_.segment<3>(3L * far_.row[static_cast<std::size_t>(from)]).cast<double>();
  }
  return u;
}

void FieldRebuild::interpolate_far(ThreadTeam& team, const ContactAtLoads& contact, Points& u) {
  team.split(u.cols(), [&](long begin, long end) {
    for (long i = begin; i < end; ++i) {
      const int row = far_.row[static_cast<std::size_t>(i)];
      if (row >= 0) {
        u.col(i) = field_.segment<3>(3L * row).cast<double>();
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
    linalg::blas::multiply(1.0F, v, factor_, 0.0F, spread_.middleRows(first, rows));
    for (long i = begin; i < end; ++i) {
      control_variance_[i] = static_cast<double>(spread_.middleRows<3>(3 * i).squaredNorm()) / 3.0 +
                             operators_.truncated_variance_mm2.row(i).dot(left_out);
    }
  });
  team.split(sd.size(), [&](long begin, long end) {
    for (long i = begin; i < end; ++i) {
      double variance = 0.0;
      for (int c = 0; c < 4; ++c) {
        variance += static_cast<double>(operators_.control_weights(c, i)) *
                    control_variance_[operators_.control_neighbours(c, i)];
      }
      sd[i] = std::sqrt(variance);
    }
  });
}

}  // namespace brainshift::inversion
