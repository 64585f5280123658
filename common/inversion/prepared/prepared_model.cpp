// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/inversion/prepared/prepared_model.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <future>
#include <utility>

#include "common/core/stopwatch.hpp"
#include "common/core/units.hpp"
#include "common/geometry/closest_point.hpp"
#include "common/linalg/openblas.hpp"
#include "common/operators/encode_columns.hpp"

namespace brainshift::inversion {
namespace {

prior::ForcePrior build_prior(const BrainModel& model, const PriorConfig& config,
                              prior::LoadModes modes,
                              const PriorScaleValues& scales = kAsInTheCase) {
  const VecX volumes = fem::nodal_volumes(model.mesh);
  const auto sd = [&](PriorPart part, double n_m3) {
    return scales[static_cast<std::size_t>(part)] * units::force_density_from_n_m3(n_m3);
  };
  const Points& nodes = model.mesh.nodes;
  const std::vector<NodeIndex> region = data_region(model);
  using prior::ForceKernel;
  const auto field = [&](PriorPart part, double length_mm, double n_m3, double near_mm) {
    auto parts =
        ForceKernel::basis_about(nodes, volumes, length_mm, sd(part, n_m3), region, near_mm);
    // Whatever becomes of the near field, the far one has the case's strength.
    if (scales[static_cast<std::size_t>(part)] !=
        scales[static_cast<std::size_t>(PriorPart::kFar)]) {
      parts.far = ForceKernel::basis_about(nodes, volumes, length_mm, sd(PriorPart::kFar, n_m3),
                                           region, near_mm)
                      .far;
    }
    return parts;
  };
  auto medium = field(PriorPart::kMedium, config.medium_length_mm, config.medium_density_sd_n_m3,
                      prior::kNearMedium_mm);
  auto coarse = field(PriorPart::kCoarse, config.coarse_length_mm, config.coarse_density_sd_n_m3,
                      prior::kNearCoarse_mm);
  auto far = ForceKernel::sum_of(medium.far, coarse.far);
  return prior::ForcePrior(
      {ForceKernel::compact(nodes, volumes, config.correlation_length_mm,
                            sd(PriorPart::kFine, config.force_density_sd_n_m3)),
       std::move(medium.near), std::move(coarse.near), std::move(far)},
      std::move(modes));
}

// Which process's each node is: neighbours together, about as many for each.
Result<contact::SharedNodes> share_nodes(const TetMesh& mesh, Ranks* ranks) {
  if (ranks == nullptr) return contact::SharedNodes{};
  const int each = (mesh.num_nodes() + ranks->size() - 1) / ranks->size();
  const SpatialBlocks blocks = spatial_blocks(mesh.nodes, each);
  if (blocks.size() != ranks->size()) {
    return invalid(fmt::format("{} processes: a mesh of {} nodes is cut into {} parts",
                               ranks->size(), mesh.num_nodes(), blocks.size()));
  }
  contact::SharedNodes shared{ranks, std::vector<int>(static_cast<std::size_t>(mesh.num_nodes()))};
  for (int b = 0; b < blocks.size(); ++b) {
    for (const int node : blocks.block(b)) shared.part[static_cast<std::size_t>(node)] = b;
  }
  return shared;
}

}  // namespace

prior::ForcePrior scaled_prior(const PreparedModel& model, const PriorScaleValues& scales) {
  prior::LoadModes modes{model.prior().modes(), model.prior().columns_of_part()};
  for (int j = 0; j < modes.size(); ++j) {
    modes.columns.col(j) *=
        scales[static_cast<std::size_t>(prior::part_of_column(j, modes.of_part))];
  }
  return build_prior(model.model(), model.config().prior, std::move(modes), scales);
}

PreparedModel::PreparedModel(std::shared_ptr<const BrainModel> model, CaseConfig config,
                             contact::ForwardModel forward,
                             std::shared_ptr<const prior::ForcePrior> prior)
    : model_(std::move(model)),
      config_(std::move(config)),
      forward_(std::move(forward)),
      prior_(std::move(prior)),
      locator_(model_->mesh) {}

Result<PreparedModel> PreparedModel::prepare(std::shared_ptr<const BrainModel> model,
                                             const CaseConfig& config, Boundary boundary,
                                             const Progress& progress,
                                             std::shared_ptr<const prior::ForcePrior> prior,
                                             Ranks* ranks) {
  const Stopwatch whole;
  linalg::use_single_threaded_blas();
  const auto shared = share_nodes(model->mesh, ranks);
  if (!shared) return tl::unexpected(shared.error());
  double prior_s = 0.0;
  std::future<Status> made;
  if (!prior) {
    made = std::async(std::launch::async, [&]() -> Status {
      const Stopwatch watch;
      auto modes = prior::load_modes(*model, config);
      if (!modes) return tl::unexpected(modes.error());
      prior = std::make_shared<const prior::ForcePrior>(
          build_prior(*model, config.prior, std::move(*modes)));
      prior_s = watch.seconds();
      return {};
    });
  }
  auto forward = contact::ForwardModel::build(*model, config, boundary, progress, *shared);
  if (made.valid()) {
    report(progress, "prior", 0.0);
    const Status status = made.get();
    if (forward && !status) return tl::unexpected(status.error());
  }
  if (!forward) return tl::unexpected(forward.error());

  PreparedModel prepared = of(std::move(model), config, std::move(*forward), std::move(prior));
  prepared.ranks_ = ranks;
  prepared.timings_.prior_s = prior_s;
  prepared.timings_.total_s = whole.seconds();
  report(progress, "ready", 1.0);
  return prepared;
}

PreparedModel PreparedModel::of(std::shared_ptr<const BrainModel> model, const CaseConfig& config,
                                contact::ForwardModel forward,
                                std::shared_ptr<const prior::ForcePrior> prior) {
  PreparedModel prepared(std::move(model), config, std::move(forward), std::move(prior));
  const fem::StiffnessFactor& factor = prepared.forward_.factor();
  PrepareTimings& timings = prepared.timings_;
  timings.assemble_s = prepared.forward_.assemble_seconds();
  timings.analyse_s = factor.analyse_seconds();
  timings.factor_s = factor.factor_seconds();
  timings.total_s = timings.assemble_s + timings.analyse_s + timings.factor_s;
  timings.factor_nonzeros = factor.nonzeros();
  timings.bytes = prepared.forward_.bytes() + prepared.prior().bytes();
  return prepared;
}

std::vector<NodeIndex> data_region(const BrainModel& model) {
  std::vector<char> near(static_cast<std::size_t>(model.mesh.num_nodes()), 0);
  const auto tumour = geometry::ClosestPointIndex::build(model.tumour);
  Eigen::AlignedBox3d box;  // no node outside is within the margin of the tumour
  for (const auto& vertex : model.tumour.vertices.colwise()) box.extend(vertex);
  box.min().array() -= kRegionMargin_mm;
  box.max().array() += kRegionMargin_mm;
  for (int i = 0; i < model.mesh.num_nodes(); ++i) {
    const Vec3 node = model.mesh.nodes.col(i);
    bool within = tumour && box.contains(node) &&
                  (tumour->closest(node).point - node).norm() < kRegionMargin_mm;
    for (std::size_t k = 0; !within && k < model.craniotomy.size(); ++k) {
      within = (model.mesh.nodes.col(model.craniotomy[k]) - node).norm() < kRegionMargin_mm;
    }
    near[static_cast<std::size_t>(i)] = static_cast<char>(within);
  }
  // Where elements are larger than the margin.
  const geometry::TetLocator locator(model.mesh);
  const auto add_element_at = [&](const Vec3& point) {
    const geometry::TetLocation location = locator.locate(point);
    for (const int node : location.nodes) near[static_cast<std::size_t>(node)] = 1;
  };
  for (int t = 0; t < model.tumour.num_triangles(); ++t) {
    Vec3 centre = Vec3::Zero();
    for (const int vertex : model.tumour.triangles.col(t)) {
      add_element_at(model.tumour.vertices.col(vertex));
      centre += model.tumour.vertices.col(vertex) / 3.0;
    }
    add_element_at(centre);
  }
  std::vector<NodeIndex> region;
  for (int i = 0; i < model.mesh.num_nodes(); ++i) {
    if (near[static_cast<std::size_t>(i)] != 0) region.push_back(i);
  }
  return region;
}

}  // namespace brainshift::inversion
