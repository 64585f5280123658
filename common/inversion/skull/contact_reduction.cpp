// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/skull/contact_reduction.hpp"

#include <algorithm>
#include <iterator>

#include "common/linalg/blas.hpp"

namespace brainshift::inversion {

ContactReduction::ContactReduction(const CondensedOperators& operators, ModeWindow window,
                                   ContactSystem& system, ThreadTeam& team)
    : operators_(operators),
      window_(window),
      system_(system),
      team_(team),
      response_(operators.num_slaves(), window.count + 1),
      before_response_(operators.num_slaves(), window.count + 1),
      columns_(new double[static_cast<std::size_t>(operators.num_slaves()) * kMaxChanges]),
      sizes_(kMaxChanges, window.count + 1) {
  for (std::vector<int>* each : {&active_, &before_, &left_, &joined_}) {
    each->reserve(static_cast<std::size_t>(operators.num_slaves()));
  }
  set_.reserve(static_cast<std::size_t>(operators.num_slaves()));
}

bool ContactReduction::list_changes() {
  left_.clear();
  joined_.clear();
  std::set_difference(before_.begin(), before_.end(), active_.begin(), active_.end(),
                      std::back_inserter(left_));
  std::set_difference(active_.begin(), active_.end(), before_.begin(), before_.end(),
                      std::back_inserter(joined_));
  const int most = std::min({kMaxChanges, size() / kPart, window_.count + 1});
  if (changes() > 0 && changes() <= most) return true;
  left_.clear();
  joined_.clear();
  return false;
}

void ContactReduction::follow() {
  const auto old = response_of(before_response_, static_cast<int>(before_.size()));
  const auto away = static_cast<Eigen::Index>(left_.size());
  const auto fresh = static_cast<Eigen::Index>(joined_.size());
  Eigen::Map<Eigen::MatrixXd> between(columns_.get(), old.rows(), fresh);
  for (Eigen::Index j = 0; j < fresh; ++j) {
    gather(operators_.compliance.col(joined_[static_cast<std::size_t>(j)]).data(), before_,
           between.col(j).data());
  }
  Eigen::Map<Eigen::MatrixXd> now(response_.data(), size(), window_.count + 1);
  auto sizes = sizes_.topRows(changes());
  team_.split(now.cols(), [&](long begin, long end) {
    for (Eigen::Index c = begin; c < end; ++c) {
      const double* load = c < window_.count ? operators_.slave_modes.col(window_.first + c).data()
                                             : operators_.initial_penetration_mm.data();
      gather(load, joined_, sizes.col(c).data() + away);
      Eigen::Index to = 0, leaving = 0;
      for (Eigen::Index from = 0; from < old.rows(); ++from) {
        const int slave = before_[static_cast<std::size_t>(from)];
        if (leaving < away && left_[static_cast<std::size_t>(leaving)] == slave) {
          sizes(leaving++, c) = old(from, c);
          continue;
        }
        while (active_[static_cast<std::size_t>(to)] != slave) now(to++, c) = 0.0;
        now(to++, c) = old(from, c);
      }
      while (to < now.rows()) now(to++, c) = 0.0;
    }
    if (fresh > 0) {
      linalg::blas::multiply_transposed(-1.0, between, old.middleCols(begin, end - begin), 1.0,
                                        sizes.block(away, begin, fresh, end - begin));
    }
  });
  Eigen::Map<Eigen::MatrixXd> columns(columns_.get(), size(), changes());
  system_.respond_to_changes(left_, joined_, columns);
  team_.split(now.cols(), [&](long begin, long end) {
    linalg::blas::multiply(1.0, columns, sizes.middleCols(begin, end - begin), 1.0,
                           now.middleCols(begin, end - begin));
  });
}

Status ContactReduction::activate(const contact::ActiveSet& set) {
  left_.clear();
  joined_.clear();
  if (set == set_) return {};
  before_ = active_;
  forget();
  if (auto status = system_.take(set); !status) return status;
  set_ = set;
  active_ = system_.active();
  if (list_changes()) {
    response_.swap(before_response_);
    follow();
    return {};
  }
  if (size() == 0) return {};
  system_.respond(Eigen::Map<Eigen::MatrixXd>(response_.data(), size(), window_.count + 1));
  return {};
}

void ContactReduction::forces_at(const VecX& z, Eigen::Ref<VecX> out) const {
  out = response().col(window_.count);
  out.noalias() -= response().leftCols(window_.count) * z;
}

Result<Eigen::MatrixXd> ContactReduction::response_before() const {
  const int k = size();
  Eigen::MatrixXd response(k, window_.first);
  if (k == 0) return response;
  if (auto status = system_.take(set_); !status) return tl::unexpected(status.error());
  response = operators_.slave_modes(active_, Eigen::seqN(0, window_.first));
  system_.solve(response);
  return response;
}

VecX ContactReduction::penetration_change(const VecX& dg, const VecX& dz, const VecX& df) const {
  VecX change = -operators_.slave_modes.leftCols(window_.first) * dg -
                operators_.slave_modes.middleCols(window_.first, window_.count) * dz;
  for (int j = 0; j < size(); ++j) {
    change -= df[j] * operators_.compliance.col(active_[static_cast<std::size_t>(j)]);
  }
  return change;
}

ContactReach::ContactReach(const CondensedOperators& operators, ModeWindow window, double beta,
                           bool contact, const ContactReduction& reduction, ThreadTeam& team)
    : operators_(operators),
      window_(window),
      beta_(beta),
      contact_(contact),
      reduction_(reduction),
      team_(team),
      opening_(operators.num_slaves()),
      closing_(operators.num_slaves()),
      crossings_(operators.num_slaves()) {}

double ContactReach::along(const VecX& step, const VecX& penetration, int most) {
  if (!contact_) return 1.0;
  const auto& active = reduction_.active();
  const int k = reduction_.size();
  auto opening = opening_.head(k);
  opening.noalias() = -reduction_.response().leftCols(window_.count) * step;
  const auto modes = operators_.slave_modes.middleCols(window_.first, window_.count);
  team_.split(closing_.size(), [&](long begin, long end) {
    closing_.segment(begin, end - begin).noalias() = -modes.middleRows(begin, end - begin) * step;
  });
  if (2 * k <= operators_.num_slaves()) {
    subtract_penetration(operators_, active, opening, team_, closing_);
  } else {  // of few open slaves each is the product of one column, because Phi is symmetric
    crossings_.setZero();
    for (int j = 0; j < k; ++j) crossings_[active[static_cast<std::size_t>(j)]] = opening[j];
    team_.split(closing_.size(), [&](long begin, long end) {
      for (long slave = begin; slave < end; ++slave) {
        if (reduction_.set()[static_cast<std::size_t>(slave)]) continue;
        closing_[slave] -= operators_.compliance.col(slave).dot(crossings_);
      }
    });
  }
  int count = 0;
  const auto cross = [&](double margin, double speed) {
    if (margin >= 0.0 && margin < speed) crossings_[count++] = margin / speed;
  };
  int next = 0;
  for (int slave = 0; slave < operators_.num_slaves(); ++slave) {
    if (next < k && active[static_cast<std::size_t>(next)] == slave) {
      cross(beta_ * penetration[slave], -opening[next]);
      ++next;
    } else {
      cross(-penetration[slave], closing_[slave]);
    }
  }
  if (count <= most) return 1.0;
  double* const crossing = crossings_.data() + most;
  std::nth_element(crossings_.data(), crossing, crossings_.data() + count);
  return std::max(kShortest, *crossing);
}

}  // namespace brainshift::inversion
