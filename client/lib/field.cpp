// SPDX-License-Identifier: Apache-2.0
#include "client/lib/field.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>
#include <utility>

namespace brainshift::client {
namespace {

using Tets = Eigen::Matrix<int, 4, Eigen::Dynamic>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
// A weight that rounding has made this negative still counts as inside: neighbours compute their
// common face differently, and no point may fall between them.
constexpr double kRounding = 1e-9;

std::size_t slot(Eigen::Index i) { return static_cast<std::size_t>(i); }

// Which tetrahedron holds a point: a uniform grid of cells, of each the tetrahedra whose box meets
// it. Tetrahedra that are flat, inverted or have a node without a place are left out.
class Locator {
 public:
  struct Found {
    int tet = -1;  // -1: none
    Eigen::Vector4d weights = Eigen::Vector4d::Zero();
  };

  Locator(const Points& nodes, const Tets& tets) {
    elements_.resize(slot(tets.cols()));
    Eigen::AlignedBox3d box;
    std::vector<Eigen::AlignedBox3d> boxes(elements_.size());
    std::size_t sound = 0;
    for (Eigen::Index t = 0; t < tets.cols(); ++t) {
      Mat3 edges;
      const Vec3 origin = nodes.col(tets(0, t));
      for (int k = 0; k < 3; ++k) edges.col(k) = nodes.col(tets(k + 1, t)) - origin;
      if (!(edges.determinant() > 0.0) || !edges.allFinite()) continue;
      elements_[slot(t)] = {edges.inverse(), origin};
      for (int k = 0; k < 4; ++k) boxes[slot(t)].extend(nodes.col(tets(k, t)));
      box.extend(boxes[slot(t)]);
      ++sound;
    }
    if (sound == 0) return;
    low_ = box.min();
    // About two tetrahedra to a cell if they filled the box.
    cell_mm_ = std::cbrt(2.0 * box.volume() / static_cast<double>(sound));
    dims_ = (box.sizes() / cell_mm_).array().ceil().cwiseMax(1.0).cast<int>();
    first_.assign(slot(dims_.prod()) + 1, 0);
    const auto each_cell = [&](const Eigen::AlignedBox3d& extent, const auto& visit) {
      if (extent.isEmpty()) return;
      const Eigen::Array3i from = cell_of(extent.min()), to = cell_of(extent.max());
      for (int z = from[2]; z <= to[2]; ++z) {
        for (int y = from[1]; y <= to[1]; ++y) {
          for (int x = from[0]; x <= to[0]; ++x) visit(index(x, y, z));
        }
      }
    };
    for (const auto& extent : boxes) each_cell(extent, [&](std::size_t c) { ++first_[c + 1]; });
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    members_.resize(slot(first_.back()));
    std::vector<int> next(first_.begin(), first_.end() - 1);
    for (std::size_t t = 0; t < boxes.size(); ++t) {
      each_cell(boxes[t], [&](std::size_t c) { members_[slot(next[c]++)] = static_cast<int>(t); });
    }
  }

  Found find(const Vec3& x) const {
    if (members_.empty()) return {};
    const Eigen::Array3d cell = ((x - low_) / cell_mm_).array();
    // Also when x is not a number.
    if (!((cell >= -kRounding) && (cell <= dims_.cast<double>() + kRounding)).all()) return {};
    const Eigen::Array3i c = cell_of(x);
    const std::size_t place = index(c[0], c[1], c[2]);
    for (int i = first_[place]; i < first_[place + 1]; ++i) {
      const int tet = members_[slot(i)];
      const Element& element = elements_[slot(tet)];
      const Vec3 w = element.inverse * (x - element.origin);
      Eigen::Vector4d weights(1.0 - w.sum(), w[0], w[1], w[2]);
      if (!(weights.minCoeff() >= -kRounding)) continue;
      weights = weights.cwiseMax(0.0);
      return {tet, weights / weights.sum()};
    }
    return {};
  }

 private:
  struct Element {
    Mat3 inverse = Mat3::Zero();  // (w1, w2, w3) = inverse * (x - origin)
    Vec3 origin = Vec3::Zero();
  };

  Eigen::Array3i cell_of(const Vec3& x) const {
    const Eigen::Array3d cell = ((x - low_) / cell_mm_).array().floor();
    return cell.cwiseMax(0.0).cwiseMin((dims_ - 1).cast<double>()).cast<int>();
  }
  std::size_t index(int x, int y, int z) const {
    return slot(x) + slot(dims_[0]) * (slot(y) + slot(dims_[1]) * slot(z));
  }

  std::vector<Element> elements_;
  Vec3 low_ = Vec3::Zero();
  double cell_mm_ = 1.0;
  Eigen::Array3i dims_ = Eigen::Array3i::Zero();  // no cell: nothing is found
  std::vector<int> first_{0}, members_;           // of cell c: first_[c] .. first_[c + 1]
};

// One value per node of the mesh; NaN where the update has none.
template <typename Values>
Values on_all_nodes(const Values& values, const std::optional<FieldPart>& part) {
  if (!part || values.size() == 0) return values;
  Values all = Values::Constant(values.rows() == 3 ? 3 : part->mesh_nodes,
                                values.rows() == 3 ? part->mesh_nodes : 1, kNan);
  for (std::size_t i = 0; i < part->nodes.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    if constexpr (Values::ColsAtCompileTime == 1) {
      all[part->nodes[i]] = values[column];
    } else {
      all.col(part->nodes[i]) = values.col(column);
    }
  }
  return all;
}

}  // namespace

struct FieldMesh::Impl {
  std::string model_id;
  Points nodes;
  Tets tets;
  Locator locator;
};

struct Field::Impl {
  std::shared_ptr<const FieldMesh::Impl> mesh;
  Points displacement;  // of every node; NaN where none was received
  VecX sd_mm, known;
  // Of the moved mesh, made when it is first asked.
  mutable std::once_flag once;
  mutable std::unique_ptr<const Locator> moved;

  FieldValues empty_values(Eigen::Index count) const {
    FieldValues values;
    values.where.assign(slot(count), Where::kOutside);
    values.displacement = Points::Constant(3, count, kNan);
    values.sd_mm = VecX::Constant(sd_mm.size() > 0 ? count : 0, kNan);
    values.known = VecX::Constant(known.size() > 0 ? count : 0, kNan);
    return values;
  }
  void set(FieldValues& values, Eigen::Index point, const Locator::Found& found) const {
    const Eigen::Vector4i nodes = mesh->tets.col(found.tet);
    Vec3 u = Vec3::Zero();
    double sd = 0.0, share = 0.0;
    for (int k = 0; k < 4; ++k) {
      u += found.weights[k] * displacement.col(nodes[k]);
      if (sd_mm.size() > 0) sd += found.weights[k] * sd_mm[nodes[k]];
      if (known.size() > 0) share += found.weights[k] * known[nodes[k]];
    }
    values.where[slot(point)] = u.allFinite() ? Where::kInside : Where::kNotReceived;
    values.displacement.col(point) = u;
    if (sd_mm.size() > 0) values.sd_mm[point] = sd;
    if (known.size() > 0) values.known[point] = share;
  }
};

Result<FieldMesh> FieldMesh::build(const BrainModel& model) {
  const TetMesh& mesh = model.mesh;
  if (!mesh.nodes.allFinite()) return fail(ErrorCode::kNotFinite, "model: a node is not finite");
  const bool named = (mesh.tets.array() >= 0 && mesh.tets.array() < mesh.num_nodes()).all();
  if (!named) return invalid("model: a tetrahedron names a node that is none");
  return FieldMesh(std::make_shared<const Impl>(
      Impl{model.model_id, mesh.nodes, mesh.tets, Locator(mesh.nodes, mesh.tets)}));
}

Result<Field> Field::of(const FieldMesh& mesh, const Update& update) {
  const auto refuse = [&](const std::string& why) {
    return invalid("update " + std::to_string(update.sequence) + ": " + why);
  };
  const Estimate& estimate = update.estimate;
  const Eigen::Index nodes = mesh.impl_->nodes.cols();
  if (!update.usable()) return refuse("its field may not be shown: it is an iterate or unusable");
  if (update.model_id != mesh.impl_->model_id) {
    return refuse("it is of model " + update.model_id + ", the mesh of " + mesh.impl_->model_id);
  }
  if (update.part && update.part->base_sequence != 0) return refuse("it carries only what changed");
  const auto columns = update.part ? static_cast<Eigen::Index>(update.part->nodes.size()) : nodes;
  const auto fits = [&](const VecX& values) {
    return values.size() == 0 || values.size() == columns;
  };
  const auto named = [&] {  // ascending
    const auto& part = *update.part;
    return part.mesh_nodes == nodes &&
           (part.nodes.empty() || (part.nodes.front() >= 0 && part.nodes.back() < nodes));
  };
  if ((update.part && !named()) || estimate.displacement.cols() != columns ||
      !fits(estimate.sd_mm) || !fits(estimate.known)) {
    return refuse("its field is not one of a mesh of " + std::to_string(nodes) + " nodes");
  }
  auto impl = std::make_shared<Impl>();
  impl->mesh = mesh.impl_;
  impl->displacement = on_all_nodes(estimate.displacement, update.part);
  impl->sd_mm = on_all_nodes(estimate.sd_mm, update.part);
  impl->known = on_all_nodes(estimate.known, update.part);
  return Field(std::move(impl));
}

FieldValues Field::at(const Points& points) const {
  FieldValues values = impl_->empty_values(points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const auto found = impl_->mesh->locator.find(points.col(i));
    if (found.tet >= 0) impl_->set(values, i, found);
  }
  return values;
}

Undeformed Field::undeformed(const Points& points) const {
  const FieldMesh::Impl& mesh = *impl_->mesh;
  std::call_once(impl_->once, [&] {
    impl_->moved = std::make_unique<const Locator>(mesh.nodes + impl_->displacement, mesh.tets);
  });
  Undeformed was;
  was.points = Points::Constant(3, points.cols(), kNan);
  was.field = impl_->empty_values(points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const auto found = impl_->moved->find(points.col(i));
    if (found.tet < 0) continue;
    impl_->set(was.field, i, found);
    was.points.col(i) = points.col(i) - was.field.displacement.col(i);
  }
  was.where = was.field.where;
  return was;
}

}  // namespace brainshift::client
