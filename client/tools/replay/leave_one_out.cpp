// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/replay/leave_one_out.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "client/tools/replay/score.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/geometry/surface.hpp"
#include "common/geometry/tet_locator.hpp"
#include "common/registration/fiducials.hpp"

namespace brainshift::client {
namespace {

using Indices = std::vector<Eigen::Index>;

// What is predicted at once, and what is left.
struct Fold {
  Indices out, rest;
};

Fold fold_of(Eigen::Index size, const std::function<bool(Eigen::Index)>& is_out) {
  Fold fold;
  for (Eigen::Index i = 0; i < size; ++i) (is_out(i) ? fold.out : fold.rest).push_back(i);
  return fold;
}

std::vector<Fold> single_points(Eigen::Index size) {
  std::vector<Fold> folds;
  const Eigen::Index count = std::min<Eigen::Index>(size, kMostLeftOut);
  for (Eigen::Index k = 0; size >= kLeastLandmarks && k < count; ++k) {
    folds.push_back(fold_of(size, [&](Eigen::Index i) { return i == k * size / count; }));
  }
  return folds;
}

std::vector<Fold> octants(const Points& points) {
  std::vector<Fold> folds;
  if (points.cols() == 0) return folds;
  const Vec3 middle = points.rowwise().mean();
  for (int octant = 0; octant < 8; ++octant) {
    Fold fold = fold_of(points.cols(), [&](Eigen::Index i) {
      const auto above = (points.col(i).array() > middle.array()).cast<int>();
      return above(0) + 2 * above(1) + 4 * above(2) == octant;
    });
    if (!fold.out.empty() && !fold.rest.empty()) folds.push_back(std::move(fold));
  }
  return folds;
}

class LeavingOut {
 public:
  LeavingOut(const DaemonLink& link, const PlayOptions& options,
             const std::vector<RecordedObservation>& recording, const BrainModel& model,
             const Progress& progress)
      : link_(link), options_(options), model_(model), locator_(model.mesh), progress_(progress) {
    for (const RecordedObservation& one : recording) {
      newest_[one.observation.source] = one.observation;
    }
  }

  Result<std::vector<LeftOutScore>> run() {
    // All sources are there, and stay: an observation replaces those of its own source alone.
    for (const auto& [source, observation] : newest_) {
      if (const auto ok = answer(observation); !ok) return tl::unexpected(ok.error());
    }
    std::vector<LeftOutScore> scores;
    for (const auto& [source, observation] : newest_) {
      auto score =
          std::visit([&](const auto& body) { return of(observation, body); }, observation.body);
      if (score) score = whole_again(observation, std::move(*score));
      if (!score) return tl::unexpected(score.error());
      if (score->points > 0) scores.push_back(std::move(*score));
    }
    return scores;
  }

 private:
  Result<LeftOutScore> of(const Observation&, const PatientPose&) { return LeftOutScore{}; }

  Result<LeftOutScore> of(const Observation& observation, const LandmarkPairs& pairs) {
    LeftOutScore score{.source = observation.source, .kind = "landmarks"};
    std::vector<double> initial, rigid, error;
    int inside = 0;
    const auto folds = single_points(pairs.undeformed.cols());
    for (const Fold& fold : folds) {
      tell(observation, folds, fold);
      const LandmarkPairs rest{pairs.undeformed(Eigen::all, fold.rest),
                               pairs.deformed(Eigen::all, fold.rest), pairs.sd_mm};
      const auto update = predict(observation, rest, score, fold);
      if (!update) return tl::unexpected(update.error());
      if (!*update) continue;
      const Vec3 x = pairs.undeformed.col(fold.out[0]), y = pairs.deformed.col(fold.out[0]);
      const geometry::TetLocation at = locator_.locate(x);
      const Estimate& estimate = (*update)->estimate;
      const Vec3 off = x + geometry::value_at(at, estimate.displacement) - y;
      initial.push_back((y - x).norm());
      error.push_back(off.norm());
      if (const auto fit = registration::register_fiducials(rest.undeformed, rest.deformed)) {
        rigid.push_back((fit->T_image_measured * x - y).norm());
      }
      if (estimate.sd_mm.size() != estimate.displacement.cols()) continue;
      const double sd = std::hypot(geometry::value_at(at, estimate.sd_mm), pairs.sd_mm);
      inside += static_cast<int>((off.array().abs() <= kNormalQuantile90 * sd).count());
      score.coverage_90 = inside / (3.0 * static_cast<double>(error.size()));
    }
    if (!rigid.empty() && rigid.size() == error.size()) score.rigid = mean_std(rigid);
    return finish(std::move(score), initial, error);
  }

  Result<LeftOutScore> of(const Observation& observation, const TumourBoundary& boundary) {
    return of_points(observation, boundary.points, model_.tumour, "tumour boundary",
                     [&](const Points& rest) {
                       return TumourBoundary{rest, boundary.sd_mm};
                     });
  }

  Result<LeftOutScore> of(const Observation& observation, const CorticalSurface& cortex) {
    return of_points(observation, cortex.surface.vertices, geometry::boundary_surface(model_.mesh),
                     "cortical surface", [&](const Points& rest) {
                       return CorticalSurface{{rest, {}}, cortex.sd_mm};
                     });
  }

  template <typename Remaining>
  Result<LeftOutScore> of_points(const Observation& observation, const Points& points,
                                 TriangleSurface surface, const char* kind, Remaining remaining) {
    LeftOutScore score{.source = observation.source, .kind = kind};
    std::vector<double> initial, error;
    const auto undeformed = geometry::ClosestPointIndex::build(surface);
    if (!undeformed) return score;
    std::vector<geometry::TetLocation> at;
    for (Eigen::Index v = 0; v < surface.vertices.cols(); ++v) {
      at.push_back(locator_.locate(surface.vertices.col(v)));
    }
    const auto folds = octants(points);
    for (const Fold& fold : folds) {
      tell(observation, folds, fold);
      const auto update =
          predict(observation, remaining(Points(points(Eigen::all, fold.rest))), score, fold);
      if (!update) return tl::unexpected(update.error());
      if (!*update) continue;
      TriangleSurface moved = surface;
      for (std::size_t v = 0; v < at.size(); ++v) {
        moved.vertices.col(static_cast<Eigen::Index>(v)) +=
            geometry::value_at(at[v], (*update)->estimate.displacement);
      }
      const auto predicted = geometry::ClosestPointIndex::build(moved);
      if (!predicted) return tl::unexpected(predicted.error());
      for (const Eigen::Index i : fold.out) {
        initial.push_back(undeformed->closest(points.col(i)).distance_mm);
        error.push_back(predicted->closest(points.col(i)).distance_mm);
      }
    }
    return finish(std::move(score), initial, error);
  }

  void tell(const Observation& observation, const std::vector<Fold>& folds,
            const Fold& fold) const {
    report(progress_, "leave out " + observation.source,
           static_cast<double>(&fold - folds.data() + 1) / static_cast<double>(folds.size()));
  }

  static LeftOutScore finish(LeftOutScore score, const std::vector<double>& initial,
                             const std::vector<double>& error) {
    score.points = static_cast<int>(error.size());
    score.initial = mean_std(initial);
    score.error = mean_std(error);
    return score;
  }

  // The next source is predicted from all of this one.
  Result<LeftOutScore> whole_again(const Observation& observation, LeftOutScore score) {
    if (score.points == 0 || newest_.size() == 1) return score;
    if (const auto ok = answer(observation); !ok) return tl::unexpected(ok.error());
    return score;
  }

  // nullopt, and counted, where the rest gives no usable field.
  template <typename Body>
  Result<std::optional<Update>> predict(Observation observation, Body rest, LeftOutScore& score,
                                        const Fold& fold) {
    observation.body = std::move(rest);
    auto message = answer(std::move(observation));
    if (!message) return tl::unexpected(message.error());
    if (!*message) score.failed += static_cast<int>(fold.out.size());
    return message;
  }

  // The final update; nullopt where it failed, is unusable or was refused.
  Result<std::optional<Update>> answer(Observation observation) {
    std::uint64_t& sequence = sent_[observation.source];
    observation.sequence = ++sequence;
    if (const auto receipt = link_.submit(observation); !receipt) {
      if (receipt.error().code == ErrorCode::kUnavailable) return tl::unexpected(receipt.error());
      return std::optional<Update>();
    }
    while (true) {
      auto message = link_.next_update(options_.timeout);
      if (!message) return tl::unexpected(message.error());
      Update& update = message->update;
      const bool ours = message->session_id == options_.session_id &&
                        update.observation_sequence == observation.sequence;
      if (!ours || (!update.final && !message->error)) continue;
      if (message->error || !update.usable()) return std::optional<Update>();
      if (update.estimate.displacement.cols() != model_.mesh.num_nodes()) {
        return fail(ErrorCode::kProtocol,
                    "an update has " + std::to_string(update.estimate.displacement.cols()) +
                        " nodes, the model " + std::to_string(model_.mesh.num_nodes()));
      }
      return std::optional<Update>(std::move(update));
    }
  }

  const DaemonLink& link_;
  const PlayOptions& options_;
  const BrainModel& model_;
  const geometry::TetLocator locator_;
  const Progress& progress_;
  std::map<std::string, Observation> newest_;
  std::map<std::string, std::uint64_t> sent_;
};

}  // namespace

Result<std::vector<LeftOutScore>> leave_one_out(const DaemonLink& link, const PlayOptions& options,
                                                const std::vector<RecordedObservation>& recording,
                                                const BrainModel& model, const Progress& progress) {
  return LeavingOut(link, options, recording, model, progress).run();
}

}  // namespace brainshift::client
