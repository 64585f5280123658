// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/compare_updates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

namespace brainshift::client {
namespace {

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool same(const MeanStd& a, const MeanStd& b) { return same(a.mean, b.mean) && same(a.std, b.std); }

bool agree(double a, double b, Agreement agreement) {
  if (agreement == Agreement::kBitForBit) return same(a, b);
  const double step = std::numeric_limits<float>::epsilon() * std::max(std::abs(a), std::abs(b));
  return std::abs(a - b) <= kRounding_mm + step;
}

class Comparison {
 public:
  Comparison(const UpdateMessage& recorded, const UpdateMessage& replayed, Agreement agreement)
      : a_(recorded), b_(replayed), agreement_(agreement) {}

  UpdateComparison run() {
    const auto code = [](const std::optional<Error>& error) {
      return error ? std::string(to_string(error->code)) : std::string("none");
    };
    words("error", code(a_.error), code(b_.error));
    if (a_.error || b_.error) return std::move(found_);
    const Estimate& a = a_.update.estimate;
    const Estimate& b = b_.update.estimate;
    words("status", to_string(a.status), to_string(b.status));
    words("quality", to_string(a.quality.quality), to_string(b.quality.quality));
    if (!(a.quality.flags == b.quality.flags)) differs("quality flags");
    field(a.displacement, b.displacement);
    values("sd_mm", a.sd_mm, b.sd_mm);
    if (a.active_slaves != b.active_slaves) {
      differs(fmt::format("active slaves: {} recorded, {} now, or others", a.contact.active,
                          b.contact.active));
    }
    if (agreement_ == Agreement::kBitForBit) exact(a, b);
    return std::move(found_);
  }

 private:
  void differs(std::string_view what) { found_.differences.emplace_back(what); }

  void words(const char* name, std::string_view recorded, std::string_view replayed) {
    if (recorded != replayed) {
      differs(fmt::format("{}: \"{}\" recorded, \"{}\" now", name, recorded, replayed));
    }
  }

  // Shapes, then entries; the greatest difference is told.
  template <typename Matrix>
  double entries(const char* name, const Matrix& a, const Matrix& b) {
    if (a.rows() != b.rows() || a.cols() != b.cols()) {
      differs(fmt::format("{}: {} numbers recorded, {} now", name, a.size(), b.size()));
      return 0.0;
    }
    double greatest = 0.0;
    Eigen::Index count = 0;
    for (Eigen::Index i = 0; i < a.size(); ++i) {
      const double x = a.data()[i], y = b.data()[i];
      if (!same(x, y)) greatest = std::max(greatest, std::abs(x - y));
      count += agree(x, y, agreement_) ? 0 : 1;
    }
    if (count > 0) differs(fmt::format("{}: {} numbers by up to {:.3g}", name, count, greatest));
    return greatest;
  }
  void field(const Points& a, const Points& b) {
    found_.displacement_mm = entries("displacement", a, b);
  }
  void values(const char* name, const VecX& a, const VecX& b) { entries(name, a, b); }

  void exact(const Estimate& a, const Estimate& b) {
    values("contact forces", a.contact_force_n, b.contact_force_n);
    if (!same(a.initial_misfit_mm, b.initial_misfit_mm)) differs("initial misfit");
    if (!same(a.misfit_mm, b.misfit_mm)) differs("misfit");
    if (!same(a.contact.max_penetration_mm, b.contact.max_penetration_mm)) differs("penetration");
    if (a.prior_scales != b.prior_scales || a.prior_absent != b.prior_absent) {
      differs("strengths of the prior");
    }
    const auto& A = a_.update.T_undeformed_deformed.matrix();
    if (A != b_.update.T_undeformed_deformed.matrix()) differs("alignment");
    if (!sources_agree(a, b)) differs("sources");
    if (parts_left_out(a_.update) != parts_left_out(b_.update)) differs("what was left out");
  }

  static bool sources_agree(const Estimate& a, const Estimate& b) {
    const auto same_source = [](const SourceSummary& x, const SourceSummary& y) {
      return x.source == y.source && x.observation_sequence == y.observation_sequence &&
             x.data == y.data && x.outliers == y.outliers && same(x.chi_square, y.chi_square);
    };
    return std::equal(a.sources.begin(), a.sources.end(), b.sources.begin(), b.sources.end(),
                      same_source);
  }

  static std::vector<std::string> parts_left_out(const Update& update) {
    std::vector<std::string> parts;
    for (const Omission& omission : update.left_out) {
      if (omission.part != "journal") parts.push_back(omission.part);
    }
    return parts;
  }

  const UpdateMessage& a_;
  const UpdateMessage& b_;
  const Agreement agreement_;
  UpdateComparison found_;
};

}  // namespace

UpdateComparison compare_updates(const UpdateMessage& recorded, const UpdateMessage& replayed,
                                 Agreement agreement) {
  return Comparison(recorded, replayed, agreement).run();
}

}  // namespace brainshift::client
