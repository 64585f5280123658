// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/sampled_operators.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <sstream>

#include "common/inversion/contract/data_check.hpp"
#include "common/linalg/column_sums.hpp"
#include "common/linalg/growing_matrix.hpp"
#include "common/operators/encode_columns.hpp"

namespace brainshift::inversion {
SampledOperators::SampledOperators(std::shared_ptr<const CondensedOperators> operators,
                                   std::shared_ptr<const geometry::TetLocator> locator,
                                   ModeWindow window, OutsideRegion outside, ThreadTeam& team)
    : operators_(std::move(operators)),
      locator_(std::move(locator)),
      window_(window),
      outside_(outside),
      team_(team),
      region_row_(static_cast<std::size_t>(operators_->num_nodes()), -1),
      has_column_(static_cast<std::size_t>(operators_->num_slaves()), 0) {
  for (std::size_t i = 0; i < operators_->region.size(); ++i) {
    region_row_[static_cast<std::size_t>(operators_->region[i])] = static_cast<int>(i);
  }
}

void SampledOperators::reserve(int data) {
  if (data <= capacity_) return;
  const auto slaves = static_cast<std::size_t>(operators_->num_slaves());
  const std::size_t contact = 3 * static_cast<std::size_t>(data) * slaves;
  // Uninitialised: memory is used as it is touched.
  std::unique_ptr<double[]> columns(new double[contact]), whitened(new double[contact]);
  linalg::replace(rows_, 4, data);
  linalg::replace(barycentric_, 4, data);
  linalg::replace(weights_, 4, data);
  linalg::replace(directions_, 3, data);
  first_row_.resize(static_cast<std::size_t>(data) + 1);
  linalg::replace(left_out_, kRemainders, data);
  linalg::replace(sd_, data);
  linalg::replace(free_body_, 3 * data, SparseData::kMaxCommonErrors + window_.count + 1);
  linalg::replace(before_, 3 * data, window_.first);
  linalg::replace(row_weights_, 3 * data);
  linalg::replace(forced_, 3 * data);
  missing_.reserve(slaves);
  columns_.reserve(slaves);
  contact_columns_ = std::move(columns);
  whitened_contact_ = std::move(whitened);
  capacity_ = data;  // all of it is there
}

Status SampledOperators::refuse(const SparseData& data, int datum, const std::string& where) {
  size_ = 0;
  std::ostringstream text;
  text << "sparse data: point " << datum << " at (" << data.positions.col(datum).transpose()
       << ") mm lies " << where;
  return invalid(text.str());
}

Status SampledOperators::locate(const SparseData& data) {
  assert(data.size() <= capacity_);
  size_ = data.size();
  outside_region_ = 0;
  std::fill(has_column_.begin(), has_column_.end(), char{0});
  common_ = data.common_error.rows() > 0 ? static_cast<int>(data.common_error.cols()) : 0;
  common_variance_ = data.common_variance;
  first_row_[0] = 0;
  for (int i = 0; i < size_; ++i) {
    const geometry::TetLocation location = locator_->locate(data.positions.col(i));
    if (!(location.distance_mm <= kOutsideTolerance_mm)) {
      return refuse(data, i, fmt::format("{:.4g} mm outside the brain", location.distance_mm));
    }
    const bool along = data.along_direction(i);
    directions_.col(i) = along ? Vec3(data.directions.col(i)) : Vec3::Zero();
    first_row_[static_cast<std::size_t>(i) + 1] = first_row(i) + (along ? 1 : 3);
    rows_.col(i) = location.nodes;
    barycentric_.col(i) = location.weights;
    RemainderVariances left_out;
    const bool outside = truncated_variance(location, left_out);
    left_out_.col(i) = left_out;
    if (!outside) continue;
    ++outside_region_;
    if (outside_ == OutsideRegion::kRefuse) {
      return refuse(data, i,
                    "outside the region that was prepared; condensed.outside_region = extend would "
                    "use it");
    }
  }
  if (outside_region_ > 0) {
    unpack_outside();
    return {};
  }
  for (int i = 0; i < size_; ++i) {
    for (int k = 0; k < 4; ++k) {  // a node outside has weight 0 here: any row will do
      rows_(k, i) = std::max(0, region_row_[static_cast<std::size_t>(rows_(k, i))]);
    }
  }
  return {};
}

void SampledOperators::unpack_outside() {
  outside_nodes_.assign(rows_.data(), rows_.data() + 4 * size_);
  std::sort(outside_nodes_.begin(), outside_nodes_.end());
  outside_nodes_.erase(std::unique(outside_nodes_.begin(), outside_nodes_.end()),
                       outside_nodes_.end());
  for (int& row : rows_.leftCols(size_).reshaped()) {
    row = static_cast<int>(std::lower_bound(outside_nodes_.begin(), outside_nodes_.end(), row) -
                           outside_nodes_.begin());
  }
  outside_modes_ = decode_rows(operators_->responses, outside_nodes_,
                               column_range(0, window_.first + window_.count), team_);
}

bool SampledOperators::truncated_variance(const geometry::TetLocation& location,
                                          RemainderVariances& out) const {
  bool outside = false;
  out.setZero();
  for (int k = 0; k < 4; ++k) {
    const int node = location.nodes[k];
    if (region_row_[static_cast<std::size_t>(node)] >= 0 || location.weights[k] == 0.0) continue;
    outside = true;
    for (int c = 0; c < 4; ++c) {
      const int control = operators_->control_neighbours(c, node);
      out += location.weights[k] * static_cast<double>(operators_->control_weights(c, node)) *
             operators_->truncated_variance_mm2.row(control).transpose();
    }
  }
  out = out.cwiseMax(0.0);
  return outside;
}

void SampledOperators::sample(const SparseData& data, const RemainderVariances& strengths_squared,
                              const Eigen::Ref<const VecX>& weights) {
  for (int i = 0; i < size_; ++i) {
    const double left_out = left_out_.col(i).dot(strengths_squared);
    sd_[i] = std::sqrt((data.sd_mm[i] * data.sd_mm[i] + left_out) / weights[i]);
    weights_.col(i) = barycentric_.col(i) / sd_[i];
    row_weights_.segment(first_row(i), first_row(i + 1) - first_row(i)).setConstant(1.0 / sd_[i]);
  }
  const Eigen::MatrixXf& modes =
      outside_region_ == 0 ? operators_->region_responses : outside_modes_;
  team_.split(window_.first + window_.count, [&](long begin, long end) {
    for (long j = begin; j < end; ++j) {
      const bool left_out = j < window_.first;
      sample_column(
          modes.col(j).data(), weights_,
          left_out ? before_.col(j).data() : free_body_.col(common_ + j - window_.first).data());
    }
  });
  for (int i = 0; i < size_; ++i) {
    put(data.displacements.col(i) / sd_[i], i, free_body_.col(common_ + window_.count).data());
    for (int q = 0; q < common_; ++q) {
      put(data.common_error.col(q).segment<3>(3 * i) / sd_[i], i, free_body_.col(q).data());
    }
  }
}

void SampledOperators::put(const Vec3& value, int datum, double* column) const {
  double* out = column + first_row(datum);
  if (first_row(datum + 1) == first_row(datum) + 1) {
    *out = directions_.col(datum).dot(value);
  } else {
    Eigen::Map<Vec3>{out} = value;
  }
}

void SampledOperators::sample_column(const float* array, const NodeWeights& weights,
                                     double* out) const {
  for (int i = 0; i < size_; ++i) {
    double x = 0.0, y = 0.0, z = 0.0;
    for (int k = 0; k < 4; ++k) {
      const double weight = weights(k, i);
      const float* node = array + 3 * static_cast<std::ptrdiff_t>(rows_(k, i));
      x += weight * static_cast<double>(node[0]);
      y += weight * static_cast<double>(node[1]);
      z += weight * static_cast<double>(node[2]);
    }
    put(Vec3(x, y, z), i, out);
  }
}

void SampledOperators::sample_contact(const std::vector<int>& slaves) {
  missing_.clear();
  for (const int slave : slaves) {
    char& has = has_column_[static_cast<std::size_t>(slave)];
    if (!has) missing_.push_back(slave);
    has = 1;
  }
  if (missing_.empty()) return;
  Eigen::MatrixXf outside;  // a column for each missing slave
  if (outside_region_ > 0) {
    std::vector<int> which = missing_;
    for (int& column : which) column = operators_->contact_column(column);
    outside = decode_rows(operators_->responses, outside_nodes_, which, team_);
  }
  team_.split(static_cast<long>(missing_.size()), [&](long begin, long end) {
    for (long j = begin; j < end; ++j) {
      const int slave = missing_[static_cast<std::size_t>(j)];
      const float* column =
          outside_region_ > 0
              ? outside.col(j).data()
              : operators_->region_responses.col(operators_->contact_column(slave)).data();
      sample_column(column, barycentric_,
                    contact_columns_.get() + static_cast<std::ptrdiff_t>(rows()) * slave);
    }
  });
}

Eigen::Map<const Eigen::MatrixXd> SampledOperators::contact(const std::vector<int>& active) {
  sample_contact(active);
  Eigen::Map<Eigen::MatrixXd> whitened(whitened_contact_.get(), rows(),
                                       static_cast<Eigen::Index>(active.size()));
  team_.split(whitened.cols(), [&](long begin, long end) {
    for (long j = begin; j < end; ++j) {
      const Eigen::Map<const VecX> column(contact_column(active[static_cast<std::size_t>(j)]),
                                          rows());
      whitened.col(j) = row_weights_.head(rows()).cwiseProduct(column);
    }
  });
  return {whitened_contact_.get(), rows(), whitened.cols()};
}

void SampledOperators::subtract_contact(const std::vector<int>& active,
                                        const Eigen::Ref<const VecX>& forces, VecX& out) {
  sample_contact(active);
  auto sum = forced_.head(rows());
  sum.setZero();
  columns_.clear();
  for (const int slave : active) columns_.push_back(contact_column(slave));
  team_.split(rows(), [&](long begin, long end) {
    linalg::add_columns(columns_.data(), forces.data(), columns_.size(), begin, end - begin,
                        sum.data() + begin);
  });
  out.array() -= row_weights_.head(rows()).array() * sum.array();
}

void SampledOperators::contact_transposed(const std::vector<int>& active, const VecX& v,
                                          Eigen::Ref<VecX> out) {
  sample_contact(active);
  auto weighted = forced_.head(rows());
  weighted = row_weights_.head(rows()).cwiseProduct(v);
  team_.split(static_cast<long>(active.size()), [&](long begin, long end) {
    for (long j = begin; j < end; ++j) {
      out[j] = Eigen::Map<const VecX>(contact_column(active[static_cast<std::size_t>(j)]), rows())
                   .dot(weighted);
    }
  });
}

}  // namespace brainshift::inversion
