// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/evidence/calculix.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "common/contact/forward_model.hpp"
#include "common/geometry/surface.hpp"
#include "common/io/files/csv_numbers.hpp"

namespace brainshift::evidence {
namespace {

namespace fs = std::filesystem;

// A text file that is written line by line and checked at the end.
class Include {
 public:
  Include(const fs::path& folder, const char* name) : path_(folder / name), out_(path_) {}
  template <typename... Values>
  void line(fmt::format_string<Values...> form, Values&&... values) {
    out_ << fmt::format(form, std::forward<Values>(values)...) << '\n';
  }
  Status close() {
    out_.close();
    if (out_) return {};
    return fail(ErrorCode::kWriteFailed, path_.string() + ": cannot be written");
  }

 private:
  fs::path path_;
  std::ofstream out_;
};

void node_lines(Include& out, const Points& nodes, int first) {
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    out.line("{}, {:.9g}, {:.9g}, {:.9g}", first + i, nodes(0, i), nodes(1, i), nodes(2, i));
  }
}

Status write_mesh(const BrainModel& model, const fem::MaterialMap& tissue, const fs::path& folder) {
  Include out(folder, "mesh.inp");
  out.line("*NODE, NSET=NBRAIN");
  node_lines(out, model.mesh.nodes, 1);
  for (std::size_t kind = 0; kind < tissue.materials.size(); ++kind) {
    out.line("*ELEMENT, TYPE=C3D4, ELSET=TISSUE{}", kind);
    for (int tet = 0; tet < model.mesh.num_tets(); ++tet) {
      if (tissue.of_tet[static_cast<std::size_t>(tet)] != static_cast<int>(kind)) continue;
      const auto corners = model.mesh.tets.col(tet);
      out.line("{}, {}, {}, {}, {}", tet + 1, corners[0] + 1, corners[1] + 1, corners[2] + 1,
               corners[3] + 1);
    }
  }
  return out.close();
}

Status write_tissue(const fem::MaterialMap& tissue, Tissue kind_of_tissue, const fs::path& folder) {
  Include out(folder, "tissue.inp");
  for (std::size_t kind = 0; kind < tissue.materials.size(); ++kind) {
    const auto [lambda, shear] = tissue.materials[kind].elastic;
    out.line("*MATERIAL, NAME=TISSUE{}", kind);
    if (kind_of_tissue == Tissue::kLinear) {
      out.line("*ELASTIC");
      out.line("{:.12g}, {:.12g}", shear * (3.0 * lambda + 2.0 * shear) / (lambda + shear),
               0.5 * lambda / (lambda + shear));
    } else {
      out.line("*HYPERELASTIC, NEO HOOKE");
      out.line("{:.12g}, {:.12g}", 0.5 * shear, 2.0 / (lambda + 2.0 / 3.0 * shear));
    }
    out.line("*EXPANSION");
    out.line("1.0");
    out.line("*SOLID SECTION, ELSET=TISSUE{0}, MATERIAL=TISSUE{0}", kind);
  }
  return out.close();
}

// n . u = 0, the largest component first: CalculiX eliminates it.
Status write_held(const BrainModel& model, const fs::path& folder) {
  Include out(folder, "held.inp");
  const Points normals = geometry::vertex_normals({model.mesh.nodes, model.boundary_triangles});
  for (const NodeIndex node : model.fixed) {
    const Vec3 n = normals.col(node);
    std::array<int, 3> axes = {0, 1, 2};
    std::sort(axes.begin(), axes.end(),
              [&n](int a, int b) { return std::abs(n[a]) > std::abs(n[b]); });
    out.line("*EQUATION");
    out.line("3");
    out.line("{0}, {1}, {2:.15g}, {0}, {3}, {4:.15g}, {0}, {5}, {6:.15g}", node + 1, axes[0] + 1,
             n[axes[0]], axes[1] + 1, n[axes[1]], axes[2] + 1, n[axes[2]]);
  }
  return out.close();
}

// Between each slave and a node of the skull that does not move.
Status write_contact(const BrainModel& model, const contact::PenaltyContact& contact,
                     const fs::path& folder) {
  Include out(folder, "contact.inp");
  const std::vector<contact::ContactPair>& pairs = contact.pairs();
  Points skull(3, contact.num_slaves());
  for (int i = 0; i < contact.num_slaves(); ++i) {
    const contact::ContactPair& pair = pairs[static_cast<std::size_t>(i)];
    skull.col(i) = model.mesh.nodes.col(pair.slave) - pair.normal;  // outward
  }
  const int first_node = model.mesh.num_nodes() + 1, first_element = model.mesh.num_tets() + 1;
  out.line("*NODE, NSET=NSKULL");
  node_lines(out, skull, first_node);
  for (int i = 0; i < contact.num_slaves(); ++i) {
    const contact::ContactPair& pair = pairs[static_cast<std::size_t>(i)];
    const Vec3 outward = -pair.normal;
    out.line("*ELEMENT, TYPE=GAPUNI, ELSET=GAP{}", i);
    out.line("{}, {}, {}", first_element + i, pair.slave + 1, first_node + i);
    out.line("*GAP, ELSET=GAP{}", i);
    out.line("{:.9g}, {:.12g}, {:.12g}, {:.12g}, , {:.9g}", -pair.initial_penetration_mm,
             outward[0], outward[1], outward[2], contact.beta());
  }
  return out.close();
}

Status write_load(const Points& load, const fs::path& folder) {
  Include out(folder, "load.inp");
  for (Eigen::Index node = 0; node < load.cols(); ++node) {
    for (int axis = 0; axis < 3; ++axis) {
      if (load(axis, node) != 0.0) {
        out.line("{}, {}, {:.12g}", node + 1, axis + 1, load(axis, node));
      }
    }
  }
  return out.close();
}

Status write_swelling(const VecX& volume_strain, const fs::path& folder) {
  Include out(folder, "swelling.inp");
  for (Eigen::Index node = 0; node < volume_strain.size(); ++node) {
    out.line("{}, {:.12g}", node + 1, std::cbrt(1.0 + volume_strain[node]) - 1.0);
  }
  return out.close();
}

}  // namespace

Status write_deck(const client::TruthBrain& brain, const contact::PenaltyContact& contact,
                  const DeckLoad& load, const fs::path& folder, Tissue kind_of_tissue) {
  if (brain.elsewhere) return invalid("CalculiX deck: of the case's own mesh alone");
  const auto tissue = contact::tissue_map(brain.model, brain.config.material);
  if (!tissue) return tl::unexpected(tissue.error());
  for (const Status& ok :
       {write_mesh(brain.model, *tissue, folder), write_tissue(*tissue, kind_of_tissue, folder),
        write_held(brain.model, folder), write_contact(brain.model, contact, folder),
        write_load(load.forces, folder), write_swelling(load.volume_strain, folder)}) {
    if (!ok) return ok;
  }
  return {};
}

Result<Points> read_printed_displacements(const fs::path& dat, int nodes) {
  std::ifstream in(dat);
  if (!in) return fail(ErrorCode::kNotFound, dat.string() + ": cannot be read");
  Points u;
  std::vector<char> seen;
  int line_number = 0;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    ++line_number;
    if (line.find("displacements") != std::string::npos) {
      u = Points::Zero(3, nodes);
      seen.assign(static_cast<std::size_t>(nodes), 0);
      inside = true;
      continue;
    }
    std::istringstream words(line);
    int node = 0;
    if (!inside || !(words >> node)) continue;
    Vec3 value;
    if (!(words >> value[0] >> value[1] >> value[2]) || node < 1 || node > nodes) {
      return invalid(fmt::format("{}:{}: no displacement of one of {} nodes", dat.string(),
                                 line_number, nodes));
    }
    u.col(node - 1) = value;
    seen[static_cast<std::size_t>(node - 1)] = 1;
  }
  if (!inside) return fail(ErrorCode::kNotFound, dat.string() + ": it has no displacements");
  const auto missing = std::count(seen.begin(), seen.end(), char{0});
  if (missing > 0) {
    return invalid(fmt::format("{}: {} of {} nodes are missing", dat.string(), missing, nodes));
  }
  return u;
}

Status write_points(const Points& points, const fs::path& file) {
  std::ofstream out(file);
  for (const auto& p : points.colwise()) {
    out << fmt::format("{:.5f},{:.5f},{:.5f}\n", p[0], p[1], p[2]);
  }
  out.close();
  if (out) return {};
  return fail(ErrorCode::kWriteFailed, file.string() + ": cannot be written");
}

Result<Points> read_points(const fs::path& file) {
  std::ifstream in(file);
  if (!in) return fail(ErrorCode::kNotFound, file.string() + ": cannot be read");
  std::vector<double> values;
  int line_number = 0;
  for (std::string line; std::getline(in, line);) {
    ++line_number;
    const auto cells = io::cells_of(line);
    bool fine = cells.size() == 3;
    for (std::size_t k = 0; fine && k < 3; ++k) {
      fine = io::parse_number(cells[k], values.emplace_back());
    }
    if (!fine) return invalid(fmt::format("{}:{}: not three numbers", file.string(), line_number));
  }
  return Points(
      Eigen::Map<const Points>(values.data(), 3, static_cast<Eigen::Index>(values.size() / 3)));
}

Result<Points> read_calculix_truth(const fs::path& folder, int patient, const Points& nodes) {
  const auto own = read_points(folder / "nodes.csv");
  if (!own) return own;
  if (own->cols() != nodes.cols() || (*own - nodes).colwise().norm().maxCoeff() > kSameNode_mm) {
    return invalid(
        fmt::format("calculix: the fields are of a mesh with {} nodes; this one has {} or others",
                    own->cols(), nodes.cols()));
  }
  auto u = read_points(folder / fmt::format("patient-{}.csv", patient));
  if (u && u->cols() != nodes.cols()) {
    return invalid(fmt::format("calculix: patient-{}.csv has {} rows for {} nodes", patient,
                               u->cols(), nodes.cols()));
  }
  return u;
}

}  // namespace brainshift::evidence
