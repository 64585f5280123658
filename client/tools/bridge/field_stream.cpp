// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/field_stream.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "common/geometry/node_choice.hpp"
#include "common/geometry/surface.hpp"
#include "common/igtl/poly_data.hpp"

namespace brainshift::client {
namespace {

constexpr const char* kDisplacement = "displacement_mm";
// In this order behind the displacement.
constexpr const char* kScalars[] = {"sd_mm", "known"};
// A ball is asked for with this much to spare, so that rounding leaves out no node.
constexpr double kSpare_mm = 1e-3;

igtl::PolyData resting(const TriangleSurface& surface, bool with_sd) {
  igtl::PolyData data = igtl::from_surface(surface);
  const auto count = surface.vertices.cols();
  data.attributes.push_back(
      {kDisplacement, igtl::AttributeKind::kVector, false, Eigen::MatrixXf::Zero(3, count)});
  if (!with_sd) return data;
  for (const char* name : kScalars) {
    data.attributes.push_back(
        {name, igtl::AttributeKind::kScalar, false, Eigen::MatrixXf::Zero(1, count)});
  }
  return data;
}

TriangleSurface surface_of(const BrainModel& model, Shape shape) {
  switch (shape) {
    case Shape::kTumour: return model.tumour;
    case Shape::kCortex: return geometry::surface_of(model.mesh.nodes, model.boundary_triangles);
    case Shape::kVentricles: return geometry::surface_of(model.mesh.nodes, model.ventricle_wall);
    case Shape::kSepta: return geometry::surface_of(model.mesh.nodes, model.septa.triangles);
  }
  return {};
}

}  // namespace

Result<FieldStream> FieldStream::build(const BrainModel& model, const StreamOptions& options) {
  std::vector<double> tumour_distance_mm;
  if (std::holds_alternative<TumourRegion>(options.region)) {
    tumour_distance_mm = geometry::distances_from_tumour(model);
  }
  const auto nodes = geometry::nodes_in_region(model, options.region, tumour_distance_mm);
  if (!nodes) return fail(nodes.error().code, "--region: " + nodes.error().message);
  const Points places = model.mesh.nodes(Eigen::all, *nodes);
  const auto grid = grid_around(places, options.margin_mm, options.spacing_mm);
  if (!grid) return tl::unexpected(grid.error());
  const geometry::TetLocator locator(model.mesh);
  // One voxel of the margin stays exact, so that every node of the region lies among exact ones.
  const double fade_mm = std::max(0.0, options.margin_mm - options.spacing_mm);
  auto sampler = GridSampler::build(locator, *grid, {.fade_mm = fade_mm});
  if (!sampler) return tl::unexpected(sampler.error());

  FieldStream stream(std::move(*sampler));
  stream.fade_mm_ = fade_mm;
  stream.model_id_ = model.model_id;
  auto rest = std::make_shared<Rest>();
  AffineTransform T_ras_voxel = AffineTransform::Identity();
  T_ras_voxel.linear() *= grid->spacing_mm;
  T_ras_voxel.translation() = grid->origin_mm;
  rest->geometry = igtl::image_geometry(grid->dims, T_ras_voxel);
  rest->with_sd = options.with_sd;
  if (options.with_surfaces) {
    for (const Shape shape : kShapes) {
      const TriangleSurface surface = surface_of(model, shape);
      if (surface.num_triangles() == 0) continue;
      const bool moves = shape != Shape::kSepta;
      if (moves) stream.anchors_of(shape) = anchors(locator, surface.vertices);
      rest->surfaces[shape] = resting(surface, moves && options.with_sd);
    }
  }
  stream.rest_ = std::move(rest);
  stream.needed_ = stream.sampler_.nodes_used();
  for (const Anchors& each : stream.anchors_) {
    stream.needed_.insert(stream.needed_.end(), each.nodes.data(),
                          each.nodes.data() + each.nodes.size());
  }
  std::sort(stream.needed_.begin(), stream.needed_.end());
  stream.needed_.erase(std::unique(stream.needed_.begin(), stream.needed_.end()),
                       stream.needed_.end());
  stream.choice_ = stream.smallest_choice(model);
  stream.choice_.with_sd = options.with_sd;
  stream.u_ = Points::Zero(3, model.mesh.nodes.cols());
  stream.sd_.values = stream.known_.values = VecX::Zero(model.mesh.nodes.cols());
  return stream;
}

FieldStream::Anchors FieldStream::anchors(const geometry::TetLocator& mesh, const Points& points) {
  Anchors result{{}, {}};
  result.nodes.resize(4, points.cols());
  result.weights.resize(4, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const auto at = mesh.locate(points.col(i));
    result.nodes.col(i) = at.nodes;
    result.weights.col(i) = at.weights;
  }
  return result;
}

FieldChoice FieldStream::smallest_choice(const BrainModel& model) const {
  if (static_cast<int>(needed_.size()) == model.mesh.num_nodes() || needed_.empty()) return {};
  if (rest_->surfaces[Shape::kCortex])
    return {};  // a ball round the whole surface leaves nothing out
  Vec3 low = model.mesh.nodes.col(needed_.front()), high = low;
  for (const NodeIndex node : needed_) {
    low = low.cwiseMin(model.mesh.nodes.col(node));
    high = high.cwiseMax(model.mesh.nodes.col(node));
  }
  BallRegion ball{0.5 * (low + high), 0.0};
  for (const NodeIndex node : needed_) {
    ball.radius_mm =
        std::max(ball.radius_mm, (model.mesh.nodes.col(node) - ball.centre_mm).norm() + kSpare_mm);
  }
  return {.region = ball};
}

Status FieldStream::take(const UpdateMessage& message) {
  const Estimate& estimate = message.update.estimate;
  if (message.update.model_id != model_id_) {
    return invalid("update of model " + message.update.model_id + ", must be of " + model_id_);
  }
  const auto columns = estimate.displacement.cols();
  sd_.has = rest_->with_sd && estimate.sd_mm.size() == columns;
  known_.has = rest_->with_sd && estimate.known.size() == columns;
  const auto& part = message.update.part;
  if (!part) {
    if (columns != u_.cols()) {
      return invalid(fmt::format("update of {} nodes, must be of {}", columns, u_.cols()));
    }
    u_ = estimate.displacement;
    if (sd_.has) sd_.values = estimate.sd_mm;
    if (known_.has) known_.values = estimate.known;
    return {};
  }
  if (part->mesh_nodes != u_.cols() ||
      !std::includes(part->nodes.begin(), part->nodes.end(), needed_.begin(), needed_.end())) {
    return invalid(fmt::format("update of {} of {} nodes leaves out nodes that were asked for",
                               part->nodes.size(), part->mesh_nodes));
  }
  for (Eigen::Index i = 0; i < columns; ++i) {
    const NodeIndex node = part->nodes[static_cast<std::size_t>(i)];
    u_.col(node) = estimate.displacement.col(i);
    if (sd_.has) sd_.values[node] = estimate.sd_mm[i];
    if (known_.has) known_.values[node] = estimate.known[i];
  }
  return {};
}

igtl::PolyData FieldStream::deformed(const igtl::PolyData& rest, const Anchors& anchors) const {
  igtl::PolyData data = rest;
  Eigen::MatrixXf& moved = data.attributes[0].values;
  for (Eigen::Index i = 0; i < anchors.nodes.cols(); ++i) {
    Vec3 u = Vec3::Zero();
    double sd = 0.0, known = 0.0;
    for (int corner = 0; corner < 4; ++corner) {
      const int node = anchors.nodes(corner, i);
      u += anchors.weights(corner, i) * u_.col(node);
      sd += anchors.weights(corner, i) * sd_.values[node];
      known += anchors.weights(corner, i) * known_.values[node];
    }
    moved.col(i) = u.cast<float>();
    if (sd_.has) data.attributes[1].values(0, i) = static_cast<float>(sd);
    if (known_.has) data.attributes[2].values(0, i) = static_cast<float>(known);
  }
  data.points += moved;
  return data;
}

Result<std::shared_ptr<Picture>> FieldStream::picture(const UpdateMessage& message) {
  if (auto ok = take(message); !ok) return tl::unexpected(ok.error());
  auto picture = std::make_shared<Picture>();
  picture->rest = rest_;
  picture->u.resize(3 * grid().num_voxels());
  sampler_.sample(u_, picture->u.data());
  for (const auto& [scalar, voxels] :
       {std::pair{&sd_, &picture->sd}, std::pair{&known_, &picture->known}}) {
    if (!scalar->has) continue;
    voxels->resize(grid().num_voxels());
    sampler_.sample_scalar(scalar->values, voxels->data());
  }
  for (const Shape shape : kShapes) {
    const auto& rest = rest_->surfaces[shape];
    if (rest && shape != Shape::kSepta) {
      picture->surfaces[shape] = deformed(*rest, anchors_of(shape));
    }
  }

  const QualityVerdict& verdict = message.update.estimate.quality;
  ShownState& state = picture->state;
  state.sequence = message.update.sequence;
  state.session_id = message.session_id;
  state.model_id = message.update.model_id;
  state.case_id = message.update.case_id;
  state.quality = to_string(verdict.quality);
  state.flags = flag_names(message.update);
  state.blank = false;
  state.has_sd = sd_.has;
  state.has_known = known_.has;
  state.grid_error_mm = sampler_.interpolation_error_mm(u_, picture->u.data());
  state.spacing_mm = grid().spacing_mm;
  state.fade_mm = fade_mm_;
  picture->time = time_now();
  return picture;
}

}  // namespace brainshift::client
