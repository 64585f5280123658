// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/field_rebuild.hpp"

#include <algorithm>
#include <cmath>

#include "common/fem/blas.hpp"
#include "common/inversion/gather_rows.hpp"

namespace brainshift::inversion {
namespace {

// Rows summed at a time: 16 KB of the result, which stays in the first cache while columns stream past.
constexpr long kChunk = 4096;

}  // namespace

FieldRebuild::FieldRebuild(const CondensedOperators& operators, ModeWindow window)
    : operators_(operators),
      window_(window),
      z_(window.count),
      forces_(operators.num_slaves()),
      field_(operators.modes.rows()),
      control_modes_(gather_rows(operators.modes, operators.control)),
      control_contact_(gather_rows(operators.contact_columns, operators.control)),
      response_(operators.num_slaves(), window.count),
      factor_(window.count, window.count),
      conditioned_(control_modes_.rows(), window.count),
      contact_storage_(new float[static_cast<std::size_t>(control_contact_.size())]),
      control_variance_(static_cast<Eigen::Index>(operators.control.size())) {}

void FieldRebuild::displacement(ThreadTeam& team, const VecX& z, const ContactReduction& contact,
                                Points& u) {
  u.resize(3, operators_.num_nodes());
  z_ = z.cast<float>();
  const int k = contact.size();
  forces_.head(k) = contact.forces().cast<float>();
  team.split(field_.size(), [&](long begin, long end) {
    for (long first = begin; first < end; first += kChunk) {
      const long rows = std::min(kChunk, end - first);
      float* out = field_.data() + first;
      std::fill(out, out + rows, 0.0F);
      for (int j = 0; j < window_.count; ++j) {
        fem::blas::add_scaled(rows, z_[j], operators_.modes.col(window_.first + j).data() + first,
                              out);
      }
      for (int j = 0; j < k; ++j) {
        const int slave = contact.active()[static_cast<std::size_t>(j)];
        fem::blas::add_scaled(rows, forces_[j],
                              operators_.contact_columns.col(slave).data() + first, out);
      }
      double* target = u.data() + first;
      for (long i = 0; i < rows; ++i) target[i] = static_cast<double>(out[i]);
    }
  });
}

void FieldRebuild::standard_deviation(ThreadTeam& team, const ContactReduction& contact,
                                      const fem::blas::In<double>& normal_factor, VecX& sd) {
  const int r = window_.count, k = contact.size();
  sd.resize(operators_.num_nodes());
  // The diagonal blocks of a float factor are exact enough for a standard deviation.
  factor_ = normal_factor.cast<float>();
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
      fem::blas::multiply(-1.0F, own, response, 1.0F, v);
    }
    fem::blas::solve_lower_transposed_right(factor_, v);
    for (long i = begin; i < end; ++i) {
      control_variance_[i] =
          static_cast<double>(conditioned_.middleRows<3>(3 * i).squaredNorm()) / 3.0 +
          operators_.truncated_variance_mm2[i];
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
