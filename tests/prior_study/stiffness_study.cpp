// SPDX-License-Identifier: GPL-3.0-or-later
// stiffness_study: how far does a brain whose stiffness varies move otherwise than the model, under
// the same forces or the same strain of swelling tissue?
//
//   d = u_true - s u_model       u_true: stiffness of a seed (client/tools/twin/stiffness.hpp)
//                                u_model: the case's stiffness
//   ratio = rms |d| / rms |u_model|, s = 1 or the best scalar of all nodes
// over all nodes, nodes near the tumour and nodes of the craniotomy.
//
// Correlation of d over distance: sum d_i . d_j / sqrt(sum |d_i|^2 sum |d_j|^2) over random pairs
// of nodes whose distance lies in a bin, all seeds and loads together, each with rms |d| = 1.
#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "client/tools/twin/load.hpp"
#include "client/tools/twin/stiffness.hpp"
#include "client/tools/twin/truth.hpp"
#include "common/contact/forward_model.hpp"
#include "common/core/random.hpp"
#include "common/core/statistics.hpp"
#include "common/fem/body_loads.hpp"
#include "common/io/config/config_file.hpp"
#include "common/linalg/openblas.hpp"
#include "common/patient/read_patient.hpp"
#include "tests/benchmarks/bench_head.hpp"
#include "tests/benchmarks/csv_table.hpp"
#include "tests/simulation/variation.hpp"
#include "tests/surgeries/study_program.hpp"

namespace brainshift::prior_study {
namespace {

constexpr double kNearTumour_mm = 25.0;  // of its centroid
constexpr double kBin_mm = 10.0;
constexpr int kBins = 12;
constexpr int kPairs = 200000;

struct Arguments {
  std::filesystem::path head = BRAINSHIFT_DEFAULT_CASE;
  double thousand_nodes = 6.0;
  int seeds = 10;
  double sd = client::kStiffnessSd;
  double length_mm = client::kStiffnessLength_mm;
  std::filesystem::path out = "stiffness.csv";
};

struct Load {
  std::string name;
  Points forces;
};

// "same forces": as for the case's stiffness. "same strain": swelling tissue pushes as its own
// stiffness makes it.
Result<std::vector<Load>> loads_of(const BrainModel& model, const CaseConfig& config) {
  std::vector<Load> loads;
  const Vec3& g = model.gravity_direction;
  for (const double level : {0.0, 15.0, 30.0, 45.0, 55.0}) {
    loads.push_back({"sag " + bench::csv_number(level) + " mm",
                     fem::buoyancy_load(model.mesh, config.material, g,
                                        model.fluid_plane_depth_mm + level, g)});
  }
  const auto tissues = contact::tissue_map(model, config.material);
  if (!tissues) return tl::unexpected(tissues.error());
  const std::vector<fem::Elasticity> of_tet = tissues->elastic();
  const auto add = [&](const std::string& name, const std::function<double(const Vec3&)>& strain) {
    loads.push_back(
        {name + " same forces", fem::swelling_load(model.mesh, config.material, strain)});
    loads.push_back({name + " same strain", fem::swelling_load(model.mesh, of_tet, strain)});
  };
  for (const double radius : {30.0, 45.0, 60.0}) {
    const client::Swelling swelling{0.25, radius, 0.0};
    const Vec3 centre = client::swelling_centre(model, swelling);
    add("swelling " + bench::csv_number(radius) + " mm",
        [=](const Vec3& x) { return client::volume_strain_at(swelling, (x - centre).norm()); });
  }
  add("brain volume -1 %", [](const Vec3&) { return -0.01; });
  return loads;
}

struct Fields {
  std::string load;
  Points free, with_contact;  // with_contact: empty where contact did not settle
  const Points& of(int contact) const { return contact ? with_contact : free; }
};

Result<std::vector<Fields>> solve(const BrainModel& model, const CaseConfig& config) {
  const auto loads = loads_of(model, config);
  if (!loads) return tl::unexpected(loads.error());
  const auto forward = contact::ForwardModel::build(model, config, Boundary::kContact);
  if (!forward) return tl::unexpected(forward.error());
  client::TruthSolver solver(*forward);
  std::vector<Fields> all;
  for (const Load& load : *loads) {
    Fields fields{load.name, {}, {}};
    if (Status ok = forward->solve(load.forces, fields.free); !ok) {
      return tl::unexpected(ok.error());
    }
    auto truth = solver.solve(load.forces);
    if (truth) {
      fields.with_contact = std::move(truth->displacement);
    } else {
      std::fprintf(stderr, "%s: %s\n", load.name.c_str(), truth.error().message.c_str());
    }
    all.push_back(std::move(fields));
  }
  return all;
}

double rms(const Points& u, const std::vector<NodeIndex>& nodes) {
  double sum = 0.0;
  for (const NodeIndex node : nodes) sum += u.col(node).squaredNorm();
  return std::sqrt(sum / static_cast<double>(nodes.size()));
}

struct Correlation {
  double both[kBins] = {}, first[kBins] = {}, second[kBins] = {};
  void add(const Points& nodes, const Points& d, Random& random) {
    const auto n = static_cast<std::uint64_t>(nodes.cols());
    const double scale = static_cast<double>(n) / d.squaredNorm();
    for (int k = 0; k < kPairs; ++k) {
      const auto i = static_cast<Eigen::Index>(random.index(n));
      const auto j = static_cast<Eigen::Index>(random.index(n));
      const int bin = static_cast<int>((nodes.col(i) - nodes.col(j)).norm() / kBin_mm);
      if (bin >= kBins || i == j) continue;
      both[bin] += scale * d.col(i).dot(d.col(j));
      first[bin] += scale * d.col(i).squaredNorm();
      second[bin] += scale * d.col(j).squaredNorm();
    }
  }
  double at(int bin) const { return both[bin] / std::sqrt(first[bin] * second[bin]); }
};

// Of all seeds: s, and per place the ratios.
struct Ratios {
  std::vector<double> scalar;
  std::array<std::vector<double>, 3> best, one;
};

struct Place {
  std::string name;
  std::vector<NodeIndex> nodes;
};

std::array<Place, 3> places_of(const BrainModel& model) {
  std::array<Place, 3> places = {{{"all", {}}, {"tumour", {}}, {"craniotomy", model.craniotomy}}};
  const Vec3 centre = model.tumour.vertices.rowwise().mean();
  for (int i = 0; i < model.mesh.num_nodes(); ++i) {
    places[0].nodes.push_back(i);
    if ((model.mesh.nodes.col(i) - centre).norm() < kNearTumour_mm) places[1].nodes.push_back(i);
  }
  return places;
}

void print(const std::vector<Fields>& expected, const std::vector<std::array<Ratios, 2>>& ratios,
           const std::array<Correlation, 2>& correlation, const std::array<Place, 3>& places) {
  for (const int contact : {0, 1}) {
    std::printf("%s\n%-32s %8s  %-15s", contact ? "with contact" : "free", "load", "rms mm",
                "best s");
    for (const Place& place : places) std::printf("  %10s: best s | s = 1   ", place.name.c_str());
    std::printf("\n");
    for (std::size_t l = 0; l < expected.size(); ++l) {
      const Ratios& of = ratios[l][static_cast<std::size_t>(contact)];
      if (of.scalar.empty()) continue;
      const MeanStd s = mean_std(of.scalar);
      std::printf("%-32s %8.3f  %.3f +/- %.3f", expected[l].load.c_str(),
                  rms(expected[l].of(contact), places[0].nodes), s.mean, s.std);
      for (std::size_t p = 0; p < places.size(); ++p) {
        const MeanStd best = mean_std(of.best[p]), one = mean_std(of.one[p]);
        std::printf("  %.3f +/- %.3f | %.3f +/- %.3f", best.mean, best.std, one.mean, one.std);
      }
      std::printf("\n");
    }
    std::printf("correlation of d by distance, bins of %g mm:", kBin_mm);
    for (int bin = 0; bin < kBins; ++bin) {
      std::printf(" %.2f", correlation[static_cast<std::size_t>(contact)].at(bin));
    }
    std::printf("\n");
  }
}

Status run(const Arguments& arguments) {
  auto config = io::read_case_config(arguments.head);
  if (!config) return tl::unexpected(config.error());
  bench::MeshWish wish;
  wish.thousand_nodes = arguments.thousand_nodes;
  if (Status ok = bench::scale_edges(*config, wish); !ok) return ok;
  const auto model = patient::build_patient(*config);
  if (!model) return tl::unexpected(model.error());
  const auto expected = solve(*model, *config);
  if (!expected) return tl::unexpected(expected.error());
  auto table = bench::CsvWriter::create(
      arguments.out, "seed,load,contact,place,model_rms_mm,s,ratio_best,ratio_one");
  if (!table) return tl::unexpected(table.error());

  const std::array<Place, 3> places = places_of(*model);
  std::vector<std::array<Ratios, 2>> ratios(expected->size());
  std::array<Correlation, 2> correlation;
  Random random(1);
  for (int seed = 1; seed <= arguments.seeds; ++seed) {
    const client::VariedBrain varied = client::vary_stiffness(
        *model, *config, arguments.sd, arguments.length_mm, static_cast<std::uint64_t>(seed));
    const auto moved = solve(varied.model, varied.config);
    if (!moved) return tl::unexpected(moved.error());
    for (std::size_t l = 0; l < expected->size(); ++l) {
      for (const int contact : {0, 1}) {
        const Points &u = (*expected)[l].of(contact), &v = (*moved)[l].of(contact);
        if (u.size() == 0 || v.size() == 0) continue;
        Ratios& of = ratios[l][static_cast<std::size_t>(contact)];
        const double s = u.cwiseProduct(v).sum() / u.squaredNorm();
        const Points best = v - s * u, one = v - u;
        of.scalar.push_back(s);
        correlation[static_cast<std::size_t>(contact)].add(model->mesh.nodes, best, random);
        for (std::size_t p = 0; p < places.size(); ++p) {
          const double size = rms(u, places[p].nodes);
          of.best[p].push_back(rms(best, places[p].nodes) / size);
          of.one[p].push_back(rms(one, places[p].nodes) / size);
          if (Status ok = table->row(
                  {std::to_string(seed), (*expected)[l].load, contact ? "yes" : "no",
                   places[p].name, bench::csv_number(size), bench::csv_number(s),
                   bench::csv_number(of.best[p].back()), bench::csv_number(of.one[p].back())});
              !ok) {
            return ok;
          }
        }
      }
    }
  }
  std::printf("%d nodes, %d seeds; sd %g, length %g mm\n", model->mesh.num_nodes(), arguments.seeds,
              arguments.sd, arguments.length_mm);
  print(*expected, ratios, correlation, places);
  return {};
}

}  // namespace
}  // namespace brainshift::prior_study

int main(int argc, char** argv) {
  brainshift::linalg::choose_blas_kernel();
  brainshift::prior_study::Arguments arguments;
  CLI::App app{"How far an unknown stiffness moves a brain from the model.", "stiffness_study"};
  app.add_option("--head", arguments.head, "case file of the head")->capture_default_str();
  app.add_option("--thousand-nodes", arguments.thousand_nodes, "size of the mesh")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1000.0));
  app.add_option("--seeds", arguments.seeds, "brains")
      ->capture_default_str()
      ->check(CLI::Range(2, 1000));
  app.add_option("--sd", arguments.sd, "of the stiffness's logarithm")
      ->capture_default_str()
      ->check(CLI::Range(0.001, 2.0));
  app.add_option("--length", arguments.length_mm, "correlation length of the stiffness, mm")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 300.0));
  app.add_option("--out", arguments.out, "table to write")->capture_default_str();
  return brainshift::surgeries::run_study(app, argc, argv,
                                          [&] { return brainshift::prior_study::run(arguments); });
}
