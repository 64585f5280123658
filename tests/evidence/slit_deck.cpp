// SPDX-License-Identifier: GPL-3.0-or-later
// slit_deck write|read FOLDER: what calculix/slit.inp includes, and what CalculiX printed as a
// table, slit.csv (a node a line, its place and its displacement, mm), for calculix.sh.
#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <string>
#include <string_view>

#include "tests/evidence/calculix.hpp"
#include "tests/support/slit_block.hpp"

namespace brainshift::evidence {
namespace {

namespace fs = std::filesystem;

// C3D8 with its faces across x at `left` and `right`, larger than the block. Its face S6 (nodes 4,
// 1, 5, 8) is that at `left`, S4 (2, 3, 7, 6) that at `right`.
std::string plate(const char* name, int element, int first_node, double left, double right) {
  std::string lines = "*NODE, NSET=NPLATE\n";
  int node = first_node;
  for (const double z : {-20.0, 50.0}) {
    for (const auto& [x, y] :
         {std::pair{left, -20.0}, {right, -20.0}, {right, 50.0}, {left, 50.0}}) {
      lines += fmt::format("{}, {}, {}, {}\n", node++, x, y, z);
    }
  }
  lines += fmt::format("*ELEMENT, TYPE=C3D8, ELSET={}\n{}", name, element);
  for (int k = 0; k < 8; ++k) lines += fmt::format(", {}", first_node + k);
  return lines + "\n";
}

std::string mesh_lines(const BrainModel& model) {
  const TetMesh& mesh = model.mesh;
  std::string lines = "*NODE, NSET=NBRAIN\n";
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    const Vec3 x = mesh.nodes.col(n);
    lines += fmt::format("{}, {:.12g}, {:.12g}, {:.12g}\n", n + 1, x[0], x[1], x[2]);
  }
  lines += "*ELEMENT, TYPE=C3D4, ELSET=TISSUE\n";
  for (int t = 0; t < mesh.num_tets(); ++t) {
    const auto corners = mesh.tets.col(t);
    lines += fmt::format("{}, {}, {}, {}, {}\n", t + 1, corners[0] + 1, corners[1] + 1,
                         corners[2] + 1, corners[3] + 1);
  }
  for (const auto& [name, into] : {std::pair{"NLEFT", -1.0}, {"NRIGHT", 1.0}}) {
    lines += fmt::format("*NSET, NSET={}\n", name);
    for (std::size_t i = 0; i < model.septa.slaves.size(); ++i) {
      if (model.septa.normals(0, static_cast<Eigen::Index>(i)) * into > 0.0) {
        lines += fmt::format("{},\n", model.septa.slaves[i] + 1);
      }
    }
  }
  const double at = test_support::kSlitPlane_mm, gap = model.septa.gap_mm;
  const int node = mesh.num_nodes() + 1, element = mesh.num_tets() + 1;
  return lines + plate("LEFTPLATE", element, node, at + gap, at + 5.0) +
         plate("RIGHTPLATE", element + 1, node + 8, at - 5.0, at - gap);
}

std::string held_lines(const TetMesh& mesh) {
  std::string lines;
  for (int n = 0; n < mesh.num_nodes(); ++n) {
    for (int axis = 0; axis < 3; ++axis) {
      if (test_support::on_roller(mesh.nodes.col(n), axis)) {
        lines += fmt::format("{}, {}\n", n + 1, axis + 1);
      }
    }
  }
  return lines;
}

std::string load_lines(const Points& load) {
  std::string lines;
  for (Eigen::Index n = 0; n < load.cols(); ++n) {
    for (int axis = 0; axis < 3; ++axis) {
      if (load(axis, n) == 0.0) continue;
      lines += fmt::format("{}, {}, {:.12g}\n", n + 1, axis + 1, load(axis, n));
    }
  }
  return lines;
}

bool write(const fs::path& folder) {
  const BrainModel model = test_support::partly_slit_block();
  bool whole = true;
  for (const auto& [name, lines] :
       {std::pair{"slit-mesh.inp", mesh_lines(model)},
        {"slit-held.inp", held_lines(model.mesh)},
        {"slit-load.inp", load_lines(test_support::load_of_partly_slit_block(model.mesh))}}) {
    std::ofstream out(folder / name);
    out << lines;
    out.close();
    whole = whole && out.good();
  }
  return whole;
}

Status read(const fs::path& folder) {
  const Points nodes = test_support::partly_slit_block().mesh.nodes;
  const auto u = read_printed_displacements(folder / "slit.dat", static_cast<int>(nodes.cols()));
  if (!u) return tl::unexpected(u.error());
  std::ofstream out(folder / "slit.csv");
  for (Eigen::Index n = 0; n < nodes.cols(); ++n) {
    out << fmt::format("{:.3f},{:.3f},{:.3f},{:.7f},{:.7f},{:.7f}\n", nodes(0, n), nodes(1, n),
                       nodes(2, n), (*u)(0, n), (*u)(1, n), (*u)(2, n));
  }
  out.close();
  if (out) return {};
  return fail(ErrorCode::kWriteFailed, (folder / "slit.csv").string() + ": cannot be written");
}

}  // namespace
}  // namespace brainshift::evidence

int main(int argc, char** argv) {
  using namespace brainshift::evidence;
  const std::string_view what = argc == 3 ? argv[1] : "";
  if (what != "write" && what != "read") {
    std::fprintf(stderr, "usage: slit_deck write|read FOLDER\n");
    return 2;
  }
  if (what == "write") {
    if (write(argv[2])) return 0;
    std::fprintf(stderr, "slit_deck: %s: cannot be written\n", argv[2]);
    return 1;
  }
  if (const auto done = read(argv[2]); !done) {
    std::fprintf(stderr, "slit_deck: %s\n", done.error().message.c_str());
    return 1;
  }
  return 0;
}
