// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/registration/fiducials.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "common/core/small_matrices.hpp"
#include "common/core/text.hpp"
#include "common/geometry/misplacement.hpp"

namespace brainshift::registration {
namespace {

// Below this ratio of the second principal spread to the first, the fiducials lie on a line: a
// rotation about it would be known some hundred times worse than the others.
constexpr double kThinnestArrangement = 0.01;
// Two fiducials nearer to one another than this fraction of the extent are one, given twice.
constexpr double kSamePlace = 1e-3;
// The largest ratio between the extents (largest distance between two points) of one arrangement
// that is measured twice.
constexpr double kExtentRatio = 1.5;
// A mistake explains an error from here on that is four times as small without it. Fewer than four
// fiducials fit too many ways.
constexpr double kExplainable_mm = 2.0, kExplained = 0.25;
constexpr Eigen::Index kTold = 4;
// Names of sides say nothing of fiducials that lie this near each other.
constexpr double kOnOneSide_mm = 20.0;

double extent_mm(const Points& points) {
  double extent = 0.0;
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    for (Eigen::Index j = 0; j < i; ++j)
      extent = std::max(extent, (points.col(i) - points.col(j)).norm());
  return extent;
}

Vec3 principal_spread(const Points& points) {
  const Points centred = points.colwise() - Vec3(points.rowwise().mean());
  return symmetric_eigenvalues(Mat3(centred * centred.transpose()));
}

Status check_set(const char* name, const Points& points) {
  if (points.cols() < 3)
    return invalid(fmt::format("fiducials: {} {}: at least 3 needed", points.cols(), name));
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    if (!points.col(i).allFinite())
      return fail(ErrorCode::kNotFinite,
                  fmt::format("fiducials: {} one {} is not finite", name, i));
  const double extent = extent_mm(points);
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    for (Eigen::Index j = 0; j < i; ++j)
      if (!((points.col(i) - points.col(j)).norm() > kSamePlace * extent))
        return invalid(
            fmt::format("fiducials: {} ones {} and {} are at the same place", name, j, i));
  const Vec3 spread = principal_spread(points);
  if (!(spread[1] > kThinnestArrangement * kThinnestArrangement * spread[2]))
    return invalid(fmt::format("fiducials: all {} {} ones lie on one line", points.cols(), name));
  return {};
}

Status check_extents(double measured_mm, double image_mm) {
  const double ratio = image_mm / measured_mm;
  const auto near = [ratio](double factor) {
    return ratio < factor * kExtentRatio && ratio > factor / kExtentRatio;
  };
  const char* guess = near(1000.0)  ? ": metres?"
                      : near(10.0)  ? ": centimetres?"
                      : near(0.001) ? ": image in metres?"
                      : near(0.1)   ? ": image in centimetres?"
                                    : ": not the same arrangement";
  return invalid(fmt::format("fiducials: the measured ones span {:.3g} and the image's {:.3g} mm{}",
                             measured_mm, image_mm, guess));
}

Status check_span(const Points& image) {
  const auto fits = [](const Points& points) {
    const double span = extent_mm(points);
    return span >= kSmallestSpan_mm && span <= kLargestSpan_mm;
  };
  if (fits(image)) return {};
  return invalid(fmt::format("fiducials: the image's span {:.3g} mm: must span {:g} to {:g} mm{}",
                             extent_mm(image), kSmallestSpan_mm, kLargestSpan_mm,
                             geometry::likely_mistake(image, fits)));
}

RigidTransform least_squares(const Points& measured, const Points& image) {
  const Vec3 from = measured.rowwise().mean(), to = image.rowwise().mean();
  const Mat3 covariance = (image.colwise() - to) * (measured.colwise() - from).transpose();
  const SingularValues svd = singular_values(covariance);
  // The best orthogonal matrix may be a reflection: for fiducials in a plane, a reflection fits as
  // well as a rotation. The weakest direction is then turned round.
  const double handedness = (svd.U * svd.V.transpose()).determinant();
  const Vec3 signs(1.0, 1.0, handedness < 0.0 ? -1.0 : 1.0);
  RigidTransform T = RigidTransform::Identity();
  T.linear() = svd.U * signs.asDiagonal() * svd.V.transpose();
  T.translation() = to - T.linear() * from;
  return T;
}

FiducialRegistration fit(const Points& measured, const Points& image) {
  FiducialRegistration result;
  result.T_image_measured = least_squares(measured, image);
  const Points off = (result.T_image_measured * measured) - image;
  const auto count = static_cast<double>(measured.cols());
  result.residuals_mm = off.colwise().norm().transpose();
  result.fre_mm = std::sqrt(result.residuals_mm.squaredNorm() / count);
  result.fle_mm = result.fre_mm / std::sqrt(1.0 - 2.0 / count);
  for (int i = 0; i < measured.cols(); ++i) result.of_image.push_back(i);
  result.image = image;
  return result;
}

// "\"left ear\" and \"right ear\"", or "fiducials 2 and 3".
std::string pair_called(const std::vector<std::string>& names, Eigen::Index i, Eigen::Index j) {
  const auto one = static_cast<std::size_t>(i), other = static_cast<std::size_t>(j);
  const bool named =
      std::max(one, other) < names.size() && !names[one].empty() && !names[other].empty();
  return named ? in_quotes(names[one]) + " and " + in_quotes(names[other])
               : fmt::format("fiducials {} and {}", i + 1, j + 1);
}

// The end of a sentence: two fiducials of the image exchanged, those that fit best, or left and
// right. "" where neither explains the error.
std::string what_explains(const Points& measured, const FiducialRegistration& found,
                          const std::vector<std::string>& names) {
  const double most = std::min(kPoorFre_mm, kExplained * found.fre_mm);
  const auto explains = [most](double fre_mm) { return fre_mm <= most; };
  std::string exchanged;
  double least = found.fre_mm;
  Points image = found.image;
  for (Eigen::Index i = 0; i < image.cols(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      image.col(i).swap(image.col(j));
      const double fre_mm = fit(measured, image).fre_mm;
      image.col(i).swap(image.col(j));
      if (!explains(fre_mm) || fre_mm >= least) continue;
      least = fre_mm;
      exchanged = fmt::format("; {} exchanged?", pair_called(names, j, i));
    }
  }
  // A rotation or a scale changes nothing here: of these mistakes only a mirror image can fit.
  const std::string mirrored = geometry::likely_mistake(
      image, [&](const Points& meant) { return explains(fit(measured, meant).fre_mm); });
  if (exchanged.empty() || mirrored.empty()) return exchanged + mirrored;
  return exchanged.substr(0, exchanged.size() - 1) + ", or" + mirrored.substr(1);
}

// Whether a word of the name, in any case, begins with `word`.
bool names_place(const std::string& name, std::string_view word) {
  const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  const auto letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  const auto same = [&](char a, char b) { return lower(a) == lower(b); };
  for (auto at = name.begin(); at != name.end(); ++at) {
    at = std::search(at, name.end(), word.begin(), word.end(), same);
    if (at == name.end()) return false;
    if (at == name.begin() || !letter(*(at - 1))) return true;
  }
  return false;
}

// What a name says of the place of its fiducial along `axis`: +1 or -1, 0: nothing.
int side_told(const std::string& name, Eigen::Index axis) {
  const auto any = [&name](std::initializer_list<const char*> words) {
    return std::any_of(words.begin(), words.end(),
                       [&name](const char* word) { return names_place(name, word); });
  };
  const bool more = axis == 0 ? any({"right"}) : any({"nasion", "nose", "glabella"});
  const bool less = axis == 0 ? any({"left"}) : any({"inion", "occiput"});
  return more == less ? 0 : more ? 1 : -1;
}

// Half a turn about an axis, LPS for RAS, leaves distances as they are; names tell it.
Status check_named_sides(const Points& image, const std::vector<std::string>& names) {
  if (static_cast<Eigen::Index>(names.size()) != image.cols()) return {};
  for (const Eigen::Index axis : {0, 1}) {
    const char* const letter = axis == 0 ? "R" : "A";
    for (Eigen::Index i = 0; i < image.cols(); ++i) {
      for (Eigen::Index j = 0; j < image.cols(); ++j) {
        const auto &more = names[static_cast<std::size_t>(i)],
                   &less = names[static_cast<std::size_t>(j)];
        if (side_told(more, axis) != 1 || side_told(less, axis) != -1) continue;
        if (image(axis, i) > image(axis, j) - kOnOneSide_mm) continue;
        return invalid(fmt::format(
            "fiducials: in the image {} ({} {:.0f} mm) lies {} {} ({} {:.0f} mm): coordinates in "
            "LPS? (a heading name,l,p,s says so)",
            in_quotes(more), letter, image(axis, i), axis == 0 ? "left of" : "behind",
            in_quotes(less), letter, image(axis, j)));
      }
    }
  }
  return {};
}

// Depth-first over assignments. A branch ends where a distance to a fiducial that is already
// assigned does not fit.
class Matcher {
 public:
  Matcher(const Points& measured, const Points& image, double tolerance_mm)
      : measured_(measured), image_(image), tolerance_mm_(tolerance_mm) {}

  void search() {
    chosen_.clear();
    extend();
  }
  const std::optional<FiducialRegistration>& best() const { return best_; }
  double second_fre_mm() const { return second_fre_mm_; }

 private:
  bool fits(int candidate) const {
    const auto i = static_cast<Eigen::Index>(chosen_.size());
    for (Eigen::Index j = 0; j < i; ++j) {
      const int other = chosen_[static_cast<std::size_t>(j)];
      if (other == candidate) return false;
      const double there = (image_.col(candidate) - image_.col(other)).norm();
      const double here = (measured_.col(i) - measured_.col(j)).norm();
      if (std::abs(there - here) > tolerance_mm_) return false;
    }
    return true;
  }
  void extend() {
    if (static_cast<Eigen::Index>(chosen_.size()) == measured_.cols()) return judge();
    for (int candidate = 0; candidate < image_.cols(); ++candidate) {
      if (!fits(candidate)) continue;
      chosen_.push_back(candidate);
      extend();
      chosen_.pop_back();
    }
  }
  void judge() {
    FiducialRegistration result = fit(measured_, image_(Eigen::all, chosen_));
    result.of_image = chosen_;
    if (result.fre_mm > tolerance_mm_) return;
    if (best_ && result.fre_mm >= best_->fre_mm) {
      second_fre_mm_ = std::min(second_fre_mm_, result.fre_mm);
      return;
    }
    if (best_) second_fre_mm_ = best_->fre_mm;
    best_ = std::move(result);
  }

  const Points& measured_;
  const Points& image_;
  double tolerance_mm_;
  std::vector<int> chosen_;
  std::optional<FiducialRegistration> best_;
  double second_fre_mm_ = std::numeric_limits<double>::infinity();
};

Status check_match(const Points& measured, const Points& image, const MatchOptions& options) {
  if (!(std::isfinite(options.tolerance_mm) && options.tolerance_mm > 0.0))
    return invalid(fmt::format("fiducials: tolerance_mm = {}: must be > 0", options.tolerance_mm));
  if (!(options.ambiguity_factor >= 1.0))
    return invalid(
        fmt::format("fiducials: ambiguity_factor = {}: must be >= 1", options.ambiguity_factor));
  if (!(options.ambiguity_mm >= 0.0))
    return invalid(fmt::format("fiducials: ambiguity_mm = {}: must be >= 0", options.ambiguity_mm));
  if (measured.cols() > 10 || image.cols() > 16 || measured.cols() > image.cols())
    return invalid(
        fmt::format("fiducials: {} measured and {} in the image: at most 10 and 16, and no more "
                    "measured than in the image",
                    measured.cols(), image.cols()));
  if (Status good = check_set("measured", measured); !good) return good;
  Status good = check_set("image", image);
  return good ? check_span(image) : good;
}

}  // namespace

Result<FiducialRegistration> register_fiducials(const Points& measured, const Points& image) {
  if (measured.cols() != image.cols())
    return invalid(
        fmt::format("fiducials: {} measured but {} in the image", measured.cols(), image.cols()));
  if (Status good = check_set("measured", measured); !good) return tl::unexpected(good.error());
  if (Status good = check_set("image", image); !good) return tl::unexpected(good.error());
  const double here = extent_mm(measured), there = extent_mm(image);
  if (std::max(here, there) > kExtentRatio * std::min(here, there))
    return tl::unexpected(check_extents(here, there).error());
  return fit(measured, image);
}

Result<FiducialRegistration> match_fiducials(const Points& measured, const Points& image,
                                             const MatchOptions& options) {
  if (Status good = check_match(measured, image, options); !good)
    return tl::unexpected(good.error());
  const double here = extent_mm(measured), there = extent_mm(image);
  // Some of the image's fiducials may not have been measured, so only the measured ones may span
  // less. A wrong unit makes a factor of at least 10.
  if (here > kExtentRatio * there || there > 8.0 * here)
    return tl::unexpected(check_extents(here, there).error());
  Matcher matcher(measured, image, options.tolerance_mm);
  matcher.search();
  if (!matcher.best()) {
    const std::string mistake = geometry::likely_mistake(image, [&](const Points& meant) {
      Matcher other(measured, meant, options.tolerance_mm);
      other.search();
      return other.best().has_value();
    });
    return fail(ErrorCode::kNotConverged,
                fmt::format("fiducials: no correspondence of {} measured to {} in the image keeps "
                            "all distances within {} mm{}",
                            measured.cols(), image.cols(), options.tolerance_mm, mistake));
  }
  const double best = matcher.best()->fre_mm, second = matcher.second_fre_mm();
  if (second < options.ambiguity_factor * best || second < best + options.ambiguity_mm)
    return invalid(
        fmt::format("fiducials: two correspondences fit nearly alike (residuals {:.2f} and {:.2f} "
                    "mm rms): give their order",
                    best, second));
  return *matcher.best();
}

Status check_head_fit(const Points& measured, const FiducialRegistration& fit,
                      const std::vector<std::string>& names) {
  if (Status good = check_span(fit.image); !good) return good;
  if (Status sides = check_named_sides(fit.image, names); !sides) return sides;
  const bool too_large = !(fit.fre_mm <= kLargestFre_mm);
  const bool told = fit.image.cols() >= kTold && fit.fre_mm > kExplainable_mm;
  if (!too_large && !told) return {};
  const std::string mistake = what_explains(measured, fit, names);
  if (too_large) {
    return invalid(fmt::format(
        "fiducials: the best fit leaves {:.1f} mm rms: must leave at most {:g} mm{}", fit.fre_mm,
        kLargestFre_mm,
        mistake.empty() ? "; are both lists of this head, mm, and in the same order?" : mistake));
  }
  if (mistake.empty()) return {};
  return invalid(
      fmt::format("fiducials: the best fit leaves {:.1f} mm rms, and less than {:.1f} "
                  "mm without a mistake{}",
                  fit.fre_mm, kExplained * fit.fre_mm, mistake));
}

double thinness(const Points& points) {
  const Vec3 spread = principal_spread(points).cwiseMax(0.0);
  return std::sqrt(spread[1] / spread[2]);
}

double expected_tre_mm(const Points& image_fiducials, double fle_mm, const Vec3& target) {
  const Vec3 centre = image_fiducials.rowwise().mean();
  const Points arms = image_fiducials.colwise() - centre;
  const auto count = static_cast<double>(arms.cols());
  const SymmetricEigen<3> principal = symmetric_eigen(Mat3(arms * arms.transpose()));
  const Vec3 spread = principal.values.cwiseMax(0.0) / count;
  const Vec3 along = principal.vectors.transpose() * (target - centre);
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    sum += (along[a] * along[a] + along[b] * along[b]) / (spread[a] + spread[b]);
  }
  return fle_mm * std::sqrt((1.0 + sum / 3.0) / count);
}

}  // namespace brainshift::registration
