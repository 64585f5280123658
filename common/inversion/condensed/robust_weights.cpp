// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/robust_weights.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "common/inversion/contract/data_check.hpp"
#include "common/linalg/growing_matrix.hpp"

namespace brainshift::inversion {

void RobustWeights::reserve(int data) {
  sorted_.reserve(static_cast<std::size_t>(data));
  linalg::replace(next_, data);
  linalg::replace(residuals_, data);
  VecX grown(data);  // data that move keep theirs
  grown.head(weights_.size()) = weights_;
  weights_.swap(grown);
}

void RobustWeights::reset(int data) {
  if (data > weights_.size()) reserve(data);
  size_ = data;
  weights_.head(size_).setOnes();
}

void RobustWeights::follow(const std::vector<DataSource>& before, const SparseData& now) {
  if (now.sources.empty() && now.size() == size_) return;
  if (now.size() > weights_.size()) reserve(now.size());
  next_.head(now.size()).setOnes();
  for (const DataSource& source : now.sources) {
    const auto same = std::find_if(before.begin(), before.end(), [&](const DataSource& one) {
      return one.name == source.name && one.count == source.count;
    });
    if (same == before.end()) continue;
    next_.segment(source.first, source.count) = weights_.segment(same->first, source.count);
  }
  size_ = now.size();
  std::swap(weights_, next_);
}

double RobustWeights::source_scale(const SparseData& data, int first, int count) {
  if (count == 0) return 1.0;
  sorted_.clear();
  for (int i = first; i < first + count; ++i) {
    sorted_.push_back(residuals_[i] / (data.along_direction(i) ? kMedianAlong : kMedianWhole));
  }
  const auto middle = sorted_.begin() + count / 2;
  std::nth_element(sorted_.begin(), middle, sorted_.end());
  return std::max(1.0, *middle);
}

bool RobustWeights::update(const SparseData& data, const Eigen::Ref<const VecX>& norms) {
  const int m = data.size();
  for (int i = 0; i < m; ++i) residuals_[i] = norms[i] / std::sqrt(weights_[i]);
  bool changed = false;
  const auto reweigh = [&](int first, int count) {
    const double scale = source_scale(data, first, count);
    for (int i = first; i < first + count; ++i) {
      const double limit = scale * (data.along_direction(i) ? kOutlierAlong : kOutlierWhole);
      const double weight = residuals_[i] <= limit ? 1.0 : std::pow(limit / residuals_[i], 4);
      changed = changed || std::abs(weight - weights_[i]) > kWeightTolerance;
      next_[i] = weight;
    }
  };
  if (data.sources.empty()) reweigh(0, m);
  for (const DataSource& source : data.sources) reweigh(source.first, source.count);
  if (changed) weights_.head(m) = next_.head(m);
  return changed;
}

int RobustWeights::outliers(int first, int count) const {
  return static_cast<int>((weights_.segment(first, count).array() < kOutlierWeight).count());
}

namespace {

// Direction of what both data measure, zero for the whole displacement. False when they measure
// different parts.
bool common_direction(const SparseData& data, int i, int j, Vec3& direction) {
  const bool along_i = data.along_direction(i), along_j = data.along_direction(j);
  direction.setZero();
  if (along_i) direction = data.directions.col(i);
  if (along_j && !along_i) direction = data.directions.col(j);
  return !(along_i && along_j) || std::abs(direction.dot(data.directions.col(j))) >= kParallel;
}

struct Difference {
  double length_mm = 0.0;  // |e|
  double sd_mm = 0.0;      // s
};

// along: what both data measure; zero: the whole displacement.
Difference difference_of(const SparseData& data, int i, int j, const Vec3& along) {
  const Vec3 difference = data.displacements.col(j) - data.displacements.col(i);
  double variance = data.sd_mm[i] * data.sd_mm[i] + data.sd_mm[j] * data.sd_mm[j];
  const bool whole = along.isZero(0.0);
  for (Eigen::Index k = 0; data.common_error.rows() > 0 && k < data.common_error.cols(); ++k) {
    const Vec3 shared =
        data.common_error.col(k).segment<3>(3 * j) - data.common_error.col(k).segment<3>(3 * i);
    variance += whole ? shared.squaredNorm() / 3.0 : std::pow(along.dot(shared), 2);
  }
  return {whole ? difference.norm() : std::abs(along.dot(difference)), std::sqrt(variance)};
}

}  // namespace

void append_contradiction(const Contradiction& found, const SparseData& data, std::string& reason) {
  if (found.pairs == 0) return;
  const Vec3 at = data.positions.col(found.first);
  char text[240];
  std::snprintf(text, sizeof text,
                "; data %d and %d at one place, (%.1f %.1f %.1f) mm, contradict each other by %.1f "
                "mm (%.0f sd)",
                found.first, found.second, at[0], at[1], at[2], found.differ_mm, found.sds);
  reason.append(text);
  if (found.pairs == 1) return;
  std::snprintf(text, sizeof text, ", the worst of %d such pairs", found.pairs);
  reason.append(text);
}

void Contradictions::reserve(int data) { order_.reserve(static_cast<std::size_t>(data)); }

Contradiction Contradictions::find(const SparseData& data) {
  order_.resize(static_cast<std::size_t>(data.size()));
  std::iota(order_.begin(), order_.end(), 0);
  const auto x = [&](int datum) { return data.positions(0, datum); };
  std::sort(order_.begin(), order_.end(), [&](int i, int j) { return x(i) < x(j); });
  Contradiction worst;
  for (std::size_t a = 0; a < order_.size(); ++a) {
    for (std::size_t b = a + 1; b < order_.size(); ++b) {
      if (x(order_[b]) - x(order_[a]) > kOnePlace_mm) break;
      const int i = std::min(order_[a], order_[b]), j = std::max(order_[a], order_[b]);
      const double apart = (data.positions.col(j) - data.positions.col(i)).norm();
      Vec3 along;
      if (apart > kOnePlace_mm || !common_direction(data, i, j, along)) continue;
      const Difference difference = difference_of(data, i, j, along);
      const double sds = (difference.length_mm - kContradictionStretch * apart) / difference.sd_mm;
      if (!(sds > (along.isZero(0.0) ? kOutlierWhole : kOutlierAlong))) continue;
      ++worst.pairs;
      if (sds <= worst.sds) continue;
      worst.first = i;
      worst.second = j;
      worst.differ_mm = difference.length_mm;
      worst.sds = sds;
    }
  }
  return worst;
}

}  // namespace brainshift::inversion
