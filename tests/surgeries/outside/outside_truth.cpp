// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/outside/outside_truth.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "client/tools/twin/resection.hpp"
#include "common/core/fnv1a.hpp"

namespace brainshift::outside {
namespace {

// Of a resection: whether a tetrahedron of the case's mesh is gone. Empty without one.
std::vector<char> gone_tets(const BrainModel& model, const CaseConfig& config, const Event& event) {
  std::vector<char> gone;
  if (!event.resected_fraction) return gone;
  BrainModel intact = model;
  intact.mesh.labels.clear();
  const auto resected = client::resect(intact, config, {*event.resected_fraction});
  if (!resected) return gone;
  for (const int label : resected->model.mesh.labels) gone.push_back(label == 1 ? 1 : 0);
  return gone;
}

double volume_of(const TetMesh& mesh, const Points& nodes, int tet) {
  const Vec3 a = nodes.col(mesh.tets(0, tet));
  return Vec3(nodes.col(mesh.tets(1, tet)) - a)
      .cross(Vec3(nodes.col(mesh.tets(2, tet)) - a))
      .dot(Vec3(nodes.col(mesh.tets(3, tet)) - a));
}

}  // namespace

OutsideTruths::OutsideTruths(const BrainModel& model, OutsideHead head)
    : model_(model), head_(std::move(head)) {}

Result<std::unique_ptr<OutsideTruths>> OutsideTruths::make(const BrainModel& model,
                                                           const CaseConfig& config) {
  auto head = make_outside_head(model, config);
  if (!head) return tl::unexpected(head.error());
  return std::unique_ptr<OutsideTruths>(new OutsideTruths(model, std::move(*head)));
}

Result<ContactBody*> OutsideTruths::body_of(const Changes& changes, std::uint64_t seed) {
  std::unique_ptr<ContactBody>& place = changes.plain() ? plain_ : changed_;
  if (changes.plain() && plain_ && plain_seed_ == seed) return plain_.get();
  place.reset();  // one factor at a time of each sort
  auto body = ContactBody::make(head_.space(), tissue_of(head_, changes, seed),
                                supports_of(head_, changes, seed));
  if (!body) return tl::unexpected(body.error());
  place = std::make_unique<ContactBody>(std::move(*body));
  if (changes.plain()) plain_seed_ = seed;
  return place.get();
}

// The body moves by steps; each is linear on the geometry that the steps before have made. Walls
// keep their normals, and what they press already may be taken back.
Result<OutsideTruths::Moved> OutsideTruths::follow(const Event& event, const VecX& gaps,
                                                   double scale, std::uint64_t seed) const {
  const fem::DisplacementSpace& space = head_.space();
  const fem::MaterialMap tissue = tissue_of(head_, event.changes, seed);
  const Supports supports = supports_of(head_, event.changes, seed);
  Moved state{Points::Zero(3, space.num_nodes()), VecX::Zero(gaps.size())};
  Points before = Points::Zero(3, space.num_nodes());
  const auto unsolved = [&](int step, const Error& error) {
    return fail(ErrorCode::kNotConverged, "step " + std::to_string(step) + " of " +
                                              std::to_string(event.steps) + ": " + error.message);
  };
  for (int step = 1; step <= event.steps; ++step) {
    TetMesh mesh = space.mesh;
    mesh.nodes += state.u.leftCols(space.num_vertices());
    const fem::DisplacementSpace now = fem::make_space(mesh, space.element);
    auto body = ContactBody::make(now, tissue, supports);
    if (!body) return unsolved(step, body.error());
    const Points load = scale * step / event.steps * event.load(now);
    const Points more = load - before - body->push(state.pressing);
    auto next = body->solve(more, gaps - body->outward(state.u));
    if (!next) return unsolved(step, next.error());
    state.u += next->displacement;
    state.pressing = std::move(next->pressing_n);
    before = load;
  }
  return state;
}

Result<OutsideTruths::Moved> OutsideTruths::moved(ContactBody& body, const Event& event,
                                                  const VecX& gaps, const Points& load,
                                                  double scale, std::uint64_t seed) const {
  if (event.steps > 1) return follow(event, gaps, scale, seed);
  auto rest = body.solve(scale * load, gaps);
  if (!rest) return tl::unexpected(rest.error());
  return Moved{std::move(rest->displacement), std::move(rest->pressing_n)};
}

OutsideTruth OutsideTruths::judged(const Event& event, const Moved& moved, double scale) const {
  OutsideTruth truth;
  truth.displacement = head_.mesh->nodes.displacement(head_.space(), moved.u);
  truth.load_scale = scale;
  truth.resected_fraction = event.resected_fraction;
  truth.pressed = static_cast<int>((moved.pressing.array() > 0.0).count());
  truth.volume_loss = event.lost ? event.lost(head_.space(), moved.u) : 0.0;
  truth.quadratic = moved.u;
  truth.load = [load = event.load, scale](const fem::DisplacementSpace& space) -> Points {
    return scale * load(space);
  };
  const Points after = model_.mesh.nodes + truth.displacement;
  for (int t = 0; t < model_.mesh.num_tets(); ++t) {
    if (!tissue_.empty() && tissue_[static_cast<std::size_t>(t)] == 0) continue;
    truth.min_volume_ratio =
        std::min(truth.min_volume_ratio,
                 volume_of(model_.mesh, after, t) / volume_of(model_.mesh, model_.mesh.nodes, t));
    for (int k = 0; k < 4; ++k) {
      truth.largest_mm =
          std::max(truth.largest_mm, truth.displacement.col(model_.mesh.tets(k, t)).norm());
    }
  }
  return truth;
}

Result<OutsideTruth> OutsideTruths::make(const Kind& kind, std::uint64_t seed) {
  Random random(seed ^ fnv1a(kind.name));
  const Event event = kind.draw(head_, random);
  tissue_ = gone_tets(model_, head_.config, event);
  for (char& each : tissue_) each = each == 0 ? 1 : 0;
  const auto body = body_of(event.changes, seed);
  if (!body) return tl::unexpected(body.error());
  VecX gaps = (*body)->gaps();
  const Supports supports = supports_of(head_, event.changes, seed);
  for (Eigen::Index i = 0; i < gaps.size(); ++i) {
    const Vec3 x = head_.space().nodes.col(supports.sides[static_cast<std::size_t>(i)].node);
    if (event.no_wall && event.no_wall(x)) gaps[i] = kNoWall;
  }
  const Points load = event.load(head_.space());
  // Secants through the logarithms of scale and motion, as without walls both grow alike.
  constexpr int kSteps = 12;
  constexpr double kClose = 0.03;
  double wanted = 1.0, scale = 1.0;  // wanted: of the largest motion or of the loss that was drawn
  for (int attempt = 0; attempt < kTries; ++attempt, wanted *= kLess) {
    double slope = 1.0, last_scale = 0.0, last_ratio = 0.0;
    for (int step = 0; step < kSteps; ++step) {
      const auto rest = (*body)->solve(scale * load, gaps);
      if (!rest) return tl::unexpected(rest.error());
      const OutsideTruth now = judged(event, {rest->displacement, rest->pressing_n}, scale);
      // How far it is on its way: of motion or of loss, whichever is reached first.
      const double ratio =
          std::max(now.largest_mm / event.largest_mm,
                   event.volume_loss > 0.0 ? now.volume_loss / event.volume_loss : 0.0) /
          wanted;
      if (!(ratio > 0.0) || !std::isfinite(ratio)) {
        return invalid("kind " + kind.name + ": its load moves nothing");
      }
      if (std::abs(ratio - 1.0) < kClose) break;
      if (step > 0 && scale != last_scale && ratio != last_ratio) {
        slope = std::clamp(std::log(ratio / last_ratio) / std::log(scale / last_scale), 0.3, 2.0);
      }
      last_scale = scale;
      last_ratio = ratio;
      scale *= std::pow(ratio, -1.0 / slope);
    }
    const auto found = moved(**body, event, gaps, load, scale, seed);
    if (!found) {
      return fail(found.error().code, "kind " + kind.name + ", seed " + std::to_string(seed) +
                                          ": " + found.error().message);
    }
    OutsideTruth truth = judged(event, *found, scale);
    if (truth.min_volume_ratio >= kLeastVolume && truth.displacement.allFinite()) return truth;
  }
  return fail(ErrorCode::kNotConverged, "kind " + kind.name + ", seed " + std::to_string(seed) +
                                            ": turns elements inside out, however small");
}

}  // namespace brainshift::outside
