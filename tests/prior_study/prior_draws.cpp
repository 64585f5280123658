// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/prior_study/prior_draws.hpp"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <set>
#include <utility>

#include "common/core/random.hpp"
#include "common/core/thread_team.hpp"
#include "common/fem/deformation.hpp"
#include "common/inversion/condensed/field_rebuild.hpp"
#include "common/inversion/skull/contact_at_loads.hpp"

namespace brainshift::prior_study {
namespace {

Vec3 mean_of(const BrainModel& model, const std::vector<NodeIndex>& nodes) {
  return model.mesh.nodes(Eigen::all, nodes).rowwise().mean();
}

template <typename Nodes>
MeshPoint closest_node(const TetMesh& mesh, const Nodes& nodes, const Vec3& place) {
  MeshPoint closest;
  double least = std::numeric_limits<double>::infinity();
  for (const NodeIndex node : nodes) {
    const double distance = (mesh.nodes.col(node) - place).squaredNorm();
    if (distance >= least) continue;
    least = distance;
    closest.nodes.setConstant(node);
  }
  return closest;
}

VecX normal_vector(int size, Random& random) {
  VecX z(size);
  for (double& value : z) value = random.normal();
  return z;
}

// One brain after the other.
class Brains {
 public:
  explicit Brains(const bench::Head& head)
      : operators_(*head.operators),
        window_{0, operators_.num_modes()},
        system_(operators_, window_, head.config.contact.penalty_n_per_mm, team_),
        contact_(operators_, window_, head.config.contact.penalty_n_per_mm, true, system_, team_),
        rebuild_(operators_, window_, team_),
        check_(head.model->mesh.nodes, head.model->mesh.tets, team_),
        places_(places_of(*head.model, *head.locator)),
        outward_(outward_of(*head.model)) {}

  Status add(const VecX& z, bool whole, PartDraws& out) {
    contact_.forget();
    if (auto status = contact_.solve(z); !status) {
      if (status.error().code != ErrorCode::kNotConverged) return tl::unexpected(status.error());
      ++out.unsettled;
      return {};
    }
    rebuild_.displacement(team_, z, contact_, u_);
    for (std::size_t p = 0; p < places_.size(); ++p) {
      out.motion_mm[p].push_back(places_[p].at(u_).norm());
    }
    out.outward_mm.push_back(places_[0].at(u_).dot(outward_));
    if (whole) out.min_volume_ratio.push_back(check_.measure(u_).min_volume_ratio);
    return {};
  }

 private:
  ThreadTeam team_;
  const CondensedOperators& operators_;
  inversion::ModeWindow window_;
  inversion::ContactSystem system_;
  inversion::ContactAtLoads contact_;
  inversion::FieldRebuild rebuild_;
  fem::DeformationCheck check_;
  std::array<MeshPoint, kPlaces> places_;
  Vec3 outward_;
  Points u_;
};

}  // namespace

Vec3 MeshPoint::at(const Points& nodal) const {
  Vec3 value = Vec3::Zero();
  for (int k = 0; k < 4; ++k) value += weights[k] * nodal.col(nodes[k]);
  return value;
}

std::array<MeshPoint, kPlaces> places_of(const BrainModel& model,
                                         const geometry::TetLocator& locator) {
  const Vec3 opening = mean_of(model, model.craniotomy);
  const geometry::TetLocation tumour = locator.locate(Vec3(model.tumour.vertices.rowwise().mean()));
  const double middle =
      0.5 * (model.mesh.nodes.row(0).minCoeff() + model.mesh.nodes.row(0).maxCoeff());
  const Vec3 mirrored(2.0 * middle - opening.x(), opening.y(), opening.z());
  return {closest_node(model.mesh, model.craniotomy, opening),
          {tumour.nodes, tumour.weights},
          closest_node(model.mesh, model.boundary_triangles.reshaped(), mirrored)};
}

Vec3 outward_of(const BrainModel& model) {
  const std::set<NodeIndex> inside(model.craniotomy.begin(), model.craniotomy.end());
  Vec3 sum = Vec3::Zero();
  for (Eigen::Index t = 0; t < model.boundary_triangles.cols(); ++t) {
    const Eigen::Vector3i corner = model.boundary_triangles.col(t);
    if (!inside.count(corner[0]) || !inside.count(corner[1]) || !inside.count(corner[2])) continue;
    const Vec3 a = model.mesh.nodes.col(corner[0]);
    sum += (model.mesh.nodes.col(corner[1]) - a).cross(model.mesh.nodes.col(corner[2]) - a);
  }
  return sum.stableNormalized();
}

VecX scaled_modes(const CondensedOperators& operators, const PriorScaleValues& strengths,
                  const VecX& z) {
  VecX scaled = z;
  for (int g = 0; g < kPriorParts; ++g) {
    const auto part = static_cast<PriorPart>(g);
    scaled.segment(operators.first_column(part), operators.columns(part)) *=
        strengths[static_cast<std::size_t>(g)];
  }
  return scaled;
}

Result<PriorScaleValues> parse_strengths(const std::vector<std::string>& texts) {
  PriorScaleValues strengths = kAsInTheCase;
  std::set<int> named;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    int part = 0;
    while (part < kPriorParts &&
           to_string(static_cast<PriorPart>(part)) != text.substr(0, equals)) {
      ++part;
    }
    const std::string number = equals == std::string::npos ? "" : text.substr(equals + 1);
    char* end = nullptr;
    const double value = std::strtod(number.c_str(), &end);
    const bool read = !number.empty() && *end == '\0' && std::isfinite(value) && value >= 0.0;
    if (part == kPriorParts || !read || !named.insert(part).second) {
      return invalid("strength " + text +
                     ": must be PART=NUMBER, at least 0, once for each part of the prior");
    }
    strengths[static_cast<std::size_t>(part)] = value;
  }
  return strengths;
}

std::array<double, kPlaces> left_out_sd_mm(const CondensedOperators& operators,
                                           const std::array<MeshPoint, kPlaces>& places) {
  std::array<double, kPlaces> sd{};
  for (std::size_t p = 0; p < places.size(); ++p) {
    double variance = 0.0;
    for (int k = 0; k < 4; ++k) {
      const NodeIndex node = places[p].nodes[k];
      for (int c = 0; c < 4; ++c) {
        variance +=
            places[p].weights[k] * static_cast<double>(operators.control_weights(c, node)) *
            operators.truncated_variance_mm2.row(operators.control_neighbours(c, node)).sum();
      }
    }
    sd[p] = std::sqrt(variance);
  }
  return sd;
}

Result<std::vector<PartDraws>> draw_prior(const bench::Head& head, int draws, std::uint64_t seed,
                                          const PriorScaleValues& strengths) {
  Brains brains(head);
  std::vector<PartDraws> all;
  for (int part = -1; part < kPriorParts; ++part) {  // -1: all together
    PriorScaleValues used = strengths;
    PartDraws drawn;
    drawn.part = "total";
    if (part >= 0) {
      if (head.operators->columns(static_cast<PriorPart>(part)) == 0) continue;
      drawn.part = to_string(static_cast<PriorPart>(part));
      used = {};
      used[static_cast<std::size_t>(part)] = strengths[static_cast<std::size_t>(part)];
    }
    Random random(seed);
    for (int i = 0; i < draws; ++i) {
      const VecX z = normal_vector(head.operators->num_modes(), random);
      if (auto status = brains.add(scaled_modes(*head.operators, used, z), part < 0, drawn);
          !status) {
        return tl::unexpected(status.error());
      }
    }
    all.push_back(std::move(drawn));
  }
  return all;
}

}  // namespace brainshift::prior_study
