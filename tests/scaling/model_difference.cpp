// SPDX-License-Identifier: GPL-3.0-or-later
// model_difference A B [BOUND_MM]: how far the updates of two model files of one patient are from
// each other: the same made-up data, under both boundaries, by method condensed. Prints one JSON
// object:
// update_mm, of a node's displacement, which is summed up from what the file keeps in less than
// single precision; compliance (relative) and modes_mm, of what it keeps in double precision: the
// response of the skull's nodes to unit forces and to the modes.
// Exit status 1 when a node's displacement differs by more than BOUND_MM, 2 for bad input.
#include <fmt/format.h>

#include <cstdlib>
#include <string>

#include "common/core/random.hpp"
#include "common/core/statistics.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/inverter.hpp"
#include "common/io/model/model_file.hpp"
#include "common/linalg/openblas.hpp"

namespace {

using namespace brainshift;

// Displacements of the data region's nodes, every fifth of them: `mm` along gravity, less with the
// distance from the opening, and noise of 0.3 mm.
SparseData made_up(const BrainModel& model, const std::vector<NodeIndex>& region, double mm) {
  Random random(11);
  Vec3 centre = Vec3::Zero();
  for (const NodeIndex node : model.craniotomy) centre += model.mesh.nodes.col(node);
  centre /= static_cast<double>(model.craniotomy.size());
  const auto count = static_cast<Eigen::Index>((region.size() + 4) / 5);
  SparseData data{Points(3, count), Points(3, count), VecX::Constant(count, 0.3)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Vec3 place = model.mesh.nodes.col(region[static_cast<std::size_t>(5 * i)]);
    const double share = std::exp(-(place - centre).squaredNorm() / (2.0 * 40.0 * 40.0));
    data.positions.col(i) = place;
    data.displacements.col(i) =
        mm * share * model.gravity_direction + 0.3 * random.normal() * random.direction();
  }
  return data;
}

struct Difference {
  double update_mm = 0.0, greatest_mm = 0.0, compliance = 0.0, modes_mm = 0.0;
  std::vector<double> update_ms;
  bool same_contact = true;
};

Status compare(const io::ModelFile& a, const io::ModelFile& b, std::size_t which,
               Difference& difference) {
  const auto locator = std::make_shared<const geometry::TetLocator>(a.model.mesh);
  std::vector<std::unique_ptr<inversion::Inverter>> inverters;
  for (const io::ModelFile* file : {&a, &b}) {
    auto made = inversion::condensed_inverter(
        std::make_shared<const CondensedOperators>(file->condensed[which]), locator, file->config);
    if (!made) return tl::unexpected(made.error());
    inverters.push_back(std::move(*made));
  }
  const Eigen::MatrixXd& phi = a.condensed[which].compliance;
  if (phi.size() > 0) {
    difference.compliance =
        (phi - b.condensed[which].compliance).cwiseAbs().maxCoeff() / phi.cwiseAbs().maxCoeff();
    difference.modes_mm =
        (a.condensed[which].slave_modes - b.condensed[which].slave_modes).cwiseAbs().maxCoeff();
  }
  inversion::InversionOptions options;
  for (const double mm : {2.0, 8.0, -4.0}) {
    const SparseData data = made_up(a.model, a.condensed[which].region, mm);
    Estimate found[2];
    for (int i = 0; i < 2; ++i) {
      const Stopwatch watch;
      if (auto ok = inverters[static_cast<std::size_t>(i)]->update(data, options, found[i]); !ok) {
        return ok;
      }
      difference.update_ms.push_back(watch.milliseconds());
    }
    const Points apart = found[0].displacement - found[1].displacement;
    difference.update_mm = std::max(difference.update_mm, apart.colwise().norm().maxCoeff());
    difference.greatest_mm =
        std::max(difference.greatest_mm, found[0].displacement.colwise().norm().maxCoeff());
    difference.same_contact &= found[0].active_slaves == found[1].active_slaves;
  }
  return {};
}

int run(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: model_difference A B [BOUND_MM]\n");
    return 2;
  }
  const auto told = [](const Error& error) {
    fmt::print(stderr, "model_difference: {}\n", error.message);
    return 2;
  };
  const auto a = io::read_model(argv[1]), b = io::read_model(argv[2]);
  for (const auto* file : {&a, &b}) {
    if (!*file) return told(file->error());
  }
  if (a->model.model_id != b->model.model_id) {
    return told({ErrorCode::kInvalidArgument,
                 fmt::format("{} is of another mesh than {}", argv[2], argv[1])});
  }
  Difference difference;
  for (std::size_t which = 0; which < a->condensed.size(); ++which) {
    if (auto ok = compare(*a, *b, which, difference); !ok) return told(ok.error());
  }
  fmt::print(
      "{{\"nodes\": {}, \"update_mm\": {:.3g}, \"greatest_mm\": {:.3g}, \"compliance\": {:.3g}, "
      "\"modes_mm\": {:.3g}, \"same_contact\": {}, \"update_ms\": {:.3f}}}\n",
      a->model.mesh.num_nodes(), difference.update_mm, difference.greatest_mm,
      difference.compliance, difference.modes_mm, difference.same_contact,
      percentile(difference.update_ms, 50.0));
  return argc > 3 && !(difference.update_mm <= std::atof(argv[3])) ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::linalg::use_single_threaded_blas();
  return run(argc, argv);
}
