// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/condensed/robust_weights.hpp"

#include <algorithm>
#include <cmath>

namespace brainshift::inversion {

void RobustWeights::reserve(int data) {
  sorted_.reserve(static_cast<std::size_t>(data));
  weights_.resize(data);
  next_.resize(data);
  residuals_.resize(data);
}

void RobustWeights::reset(int data) {
  if (data > weights_.size()) reserve(data);
  size_ = data;
  weights_.head(size_).setOnes();
}

void RobustWeights::follow(const std::vector<DataSource>& before, const SparseData& now) {
  if (now.sources.empty() && now.size() == size_) return;
  if (now.size() > weights_.size()) {  // reserve() would forget the weights
    const VecX kept = weights_;
    reserve(now.size());
    weights_.head(kept.size()) = kept;
  }
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

}  // namespace brainshift::inversion
