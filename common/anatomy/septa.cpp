// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/septa.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "common/geometry/closest_point.hpp"
#include "common/geometry/mesh_quality.hpp"
#include "common/geometry/surface.hpp"
#include "common/values/brain_model.hpp"

namespace brainshift::anatomy {
namespace {

using Facet = std::array<int, 3>;

// In notes; errors name the file too.
constexpr const char* kKey = "anatomy.labels";

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// The tetrahedra that stay.
std::vector<int> untaken(const std::vector<char>& taken) {
  std::vector<int> tets;
  for (std::size_t t = 0; t < taken.size(); ++t) {
    if (!taken[t]) tets.push_back(static_cast<int>(t));
  }
  return tets;
}

double area_of(const Points& nodes, const Facet& f) {
  const Vec3 a = nodes.col(f[0]), b = nodes.col(f[1]), c = nodes.col(f[2]);
  return 0.5 * (b - a).cross(c - a).norm();
}

// Of a tumour that is not closed there is none: no point is known to lie in it.
using ClosedTumour = std::optional<geometry::ClosestPointIndex>;
ClosedTumour closed_tumour(const TriangleSurface& tumour) {
  if (!geometry::is_closed(tumour)) return {};
  auto index = geometry::ClosestPointIndex::build(tumour);
  return index ? ClosedTumour(std::move(*index)) : ClosedTumour();
}

// Which tetrahedra are taken out.
std::vector<char> cavities(const TetMesh& mesh, Notes* notes) {
  std::vector<char> outer(at(mesh.num_nodes()), 0);
  const Eigen::Matrix3Xi surface = geometry::boundary_triangles(mesh);
  for (const int n : surface.reshaped()) outer[at(n)] = 1;
  std::vector<int> inside;
  double touching_mm3 = 0.0, small_mm3 = 0.0, all_mm3 = 0.0;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    if (mesh.labels[at(t)] != kVentricleRegion) continue;
    const auto nodes = mesh.tets.col(t);
    all_mm3 += geometry::tet_volume(mesh, t);
    if (std::any_of(nodes.begin(), nodes.end(), [&](int n) { return outer[at(n)] != 0; })) {
      touching_mm3 += geometry::tet_volume(mesh, t);
    } else {
      inside.push_back(t);
    }
  }
  std::vector<char> taken(at(mesh.num_tets()), 0);
  const geometry::TetComponents parts = geometry::tet_components(mesh.tets(Eigen::all, inside));
  std::vector<double> volumes(parts.sizes.size(), 0.0);
  for (std::size_t i = 0; i < inside.size(); ++i) {
    volumes[at(parts.component_of_tet[i])] += geometry::tet_volume(mesh, inside[i]);
  }
  for (std::size_t i = 0; i < inside.size(); ++i) {
    const bool large = volumes[at(parts.component_of_tet[i])] >= kSmallestVentricle_mm3;
    taken[at(inside[i])] = large;
    if (!large) small_mm3 += geometry::tet_volume(mesh, inside[i]);
  }
  if (touching_mm3 > 0.05 * all_mm3 || small_mm3 > 0.0) {
    add_note(notes, fmt::format("{}: of {:.1f} cc of ventricles in the mesh {:.1f} cc touch the "
                                "brain's surface and {:.1f} cc lie apart in parts below {:g} cc; "
                                "they are brain{}",
                                kKey, all_mm3 / 1e3, touching_mm3 / 1e3, small_mm3 / 1e3,
                                kSmallestVentricle_mm3 / 1e3,
                                what_to_do((touching_mm3 + small_mm3) / all_mm3, "ventricles")));
  }
  return taken;
}

// Takes tissue that stands in ventricles and touches no other.
void take_islands(const TetMesh& mesh, std::vector<char>& taken, Notes* notes) {
  const std::vector<int> tissue = untaken(taken);
  const geometry::TetComponents parts = geometry::tet_components(mesh.tets(Eigen::all, tissue));
  if (parts.sizes.size() < 2) return;
  const auto brain = std::max_element(parts.sizes.begin(), parts.sizes.end());
  const auto largest = static_cast<int>(brain - parts.sizes.begin());
  double islands_mm3 = 0.0, ventricles_mm3 = 0.0;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    ventricles_mm3 += taken[at(t)] ? geometry::tet_volume(mesh, t) : 0.0;
  }
  for (std::size_t i = 0; i < tissue.size(); ++i) {
    if (parts.component_of_tet[i] == largest) continue;
    taken[at(tissue[i])] = 1;
    islands_mm3 += geometry::tet_volume(mesh, tissue[i]);
  }
  add_note(notes, fmt::format("{}: {} parts of tissue, of {:.2f} cc together, stand in ventricles "
                              "without touching the brain; they are ventricle{}",
                              kKey, parts.sizes.size() - 1, islands_mm3 / 1e3,
                              what_to_do(islands_mm3 / ventricles_mm3, "ventricles")));
}

// kInvalidArgument: the tumour has lost its tissue to the ventricles.
Status check_tumour(const TetMesh& mesh, const std::vector<char>& taken,
                    const ClosedTumour& inside_tumour, const std::string& what) {
  if (!inside_tumour) return {};
  double all_mm3 = 0.0, lost_mm3 = 0.0;
  for (int t = 0; t < mesh.num_tets(); ++t) {
    Vec3 centre = Vec3::Zero();
    for (int k = 0; k < 4; ++k) centre += 0.25 * mesh.nodes.col(mesh.tets(k, t));
    if (!inside_tumour->contains(centre)) continue;
    const double volume_mm3 = geometry::tet_volume(mesh, t);
    all_mm3 += volume_mm3;
    lost_mm3 += taken[at(t)] ? volume_mm3 : 0.0;
  }
  if (lost_mm3 <= kLargestLostTumour * all_mm3) return {};
  return invalid(
      fmt::format("{}: {:.0f} % of the tumour stand in ventricles without touching tissue of the "
                  "mesh (anatomy.ventricles: off takes ventricles for tissue)",
                  what, 100.0 * lost_mm3 / all_mm3));
}

using Edge = std::pair<int, int>;
std::array<Edge, 3> edges_of(const Facet& f) {
  return {{{f[0], f[1]}, {f[0], f[2]}, {f[1], f[2]}}};
}

// The facets of one septum without teeth and islands. rim: edges of the outer surface, which hold a
// facet as a neighbour does.
geometry::Facets without_teeth_and_islands(geometry::Facets facets, const Points& nodes,
                                           const std::vector<Edge>& rim, const char* name,
                                           Notes* notes) {
  double teeth_mm2 = 0.0;
  for (bool found = true; found;) {
    std::map<Edge, int> uses;
    for (const Facet& f : facets)
      for (const Edge& edge : edges_of(f)) ++uses[edge];
    const auto hangs = [&](const Facet& f) {
      int held = 0;
      for (const Edge& edge : edges_of(f)) {
        held += uses[edge] > 1 || std::binary_search(rim.begin(), rim.end(), edge) ? 1 : 0;
      }
      return held < 2;
    };
    found = std::erase_if(facets, [&](const Facet& f) {
              const bool tooth = hangs(f);
              teeth_mm2 += tooth ? area_of(nodes, f) : 0.0;
              return tooth;
            }) > 0;
  }
  // Facets that edges join, by the lowest of them.
  std::vector<std::size_t> part(facets.size());
  std::map<Edge, std::vector<std::size_t>> at_edge;
  for (std::size_t i = 0; i < facets.size(); ++i)
    for (const Edge& edge : edges_of(facets[i])) at_edge[edge].push_back(i);
  std::map<std::size_t, double> areas;
  std::vector<char> seen(facets.size(), 0);
  for (std::size_t start = 0; start < facets.size(); ++start) {
    if (seen[start]) continue;
    std::vector<std::size_t> front = {start};
    seen[start] = 1;
    while (!front.empty()) {
      const std::size_t i = front.back();
      front.pop_back();
      part[i] = start;
      areas[start] += area_of(nodes, facets[i]);
      for (const Edge& edge : edges_of(facets[i]))
        for (const std::size_t next : at_edge[edge]) {
          if (!seen[next]) front.push_back(next);
          seen[next] = 1;
        }
    }
  }
  geometry::Facets kept;
  for (std::size_t i = 0; i < facets.size(); ++i) {
    if (areas[part[i]] >= kSmallestSeptum_mm2) kept.push_back(facets[i]);
  }
  double islands_mm2 = 0.0, left_mm2 = 0.0;
  for (const auto& [first, area] : areas) {
    (area >= kSmallestSeptum_mm2 ? left_mm2 : islands_mm2) += area;
  }
  const double lost_mm2 = teeth_mm2 + islands_mm2;
  if (lost_mm2 > 0.0) {
    add_note(notes, fmt::format("{}: {} of {:.1f} cm2; {:.1f} cm2 that hang on its edge or stand "
                                "apart are left out{}",
                                kKey, name, left_mm2 / 100.0, lost_mm2 / 100.0,
                                what_to_do(lost_mm2 / (left_mm2 + lost_mm2), name)));
  }
  return kept;
}

// Interface facets of each septum.
std::array<geometry::Facets, 2> parted_facets(const TetMesh& mesh, const Regions& regions,
                                              const std::vector<char>& taken,
                                              const ClosedTumour& inside_tumour, Notes* notes) {
  std::array<geometry::Facets, 2> facets;
  double through_tumour_mm2 = 0.0;
  std::map<std::pair<Septum, int>, bool> known;
  const std::vector<geometry::MeshFace> faces = geometry::sorted_faces(mesh.tets);
  for (std::size_t f = 0; f + 1 < faces.size(); ++f) {
    if (faces[f].nodes != faces[f + 1].nodes) continue;
    if (taken[at(faces[f].tet)] || taken[at(faces[f + 1].tet)]) continue;
    const Septum septum =
        septum_between(mesh.labels[at(faces[f].tet)], mesh.labels[at(faces[f + 1].tet)]);
    if (septum == Septum::kNone) continue;
    Vec3 centre = Vec3::Zero();
    bool parted = true;
    for (const int n : faces[f].nodes) {
      centre += mesh.nodes.col(n) / 3.0;
      const auto [entry, added] = known.try_emplace({septum, n}, false);
      if (added) entry->second = regions.parted(septum, mesh.nodes.col(n));
      parted = parted && entry->second;
    }
    if (!parted || !regions.parted(septum, centre)) continue;
    if (inside_tumour && inside_tumour->contains(centre)) {
      through_tumour_mm2 += area_of(mesh.nodes, faces[f].nodes);
      continue;
    }
    facets[septum == Septum::kFalx ? 0 : 1].push_back(faces[f].nodes);
  }
  if (through_tumour_mm2 > 0.0) {
    add_note(notes, fmt::format("{}: {:.1f} cm2 of falx and tentorium lie inside the tumour, which "
                                "joins their sides; they are left out{}",
                                kKey, through_tumour_mm2 / 100.0, what_to_do(0.0, "tumour")));
  }
  return facets;
}

// Leaves out the facets about tissue that they would part from the brain: of less than
// kSmallestPiece_mm3 together with all that stays joined to it.
void join_pieces(const TetMesh& mesh, const std::vector<char>& taken, geometry::Facets& facets,
                 std::vector<int>& septum_of, Notes* notes) {
  const std::vector<int> tissue = untaken(taken);
  const Eigen::Matrix<int, 4, Eigen::Dynamic> tets = mesh.tets(Eigen::all, tissue);
  geometry::Facets walls = facets;
  std::sort(walls.begin(), walls.end());
  const geometry::TetComponents parts = geometry::tet_components(tets, walls);
  if (parts.sizes.size() < 2) return;
  std::vector<double> volumes(parts.sizes.size(), 0.0);
  for (std::size_t i = 0; i < tissue.size(); ++i) {
    volumes[at(parts.component_of_tet[i])] += geometry::tet_volume(mesh, tissue[i]);
  }
  std::set<Facet> about_small;
  for (const geometry::MeshFace& face : geometry::sorted_faces(tets)) {
    if (volumes[at(parts.component_of_tet[at(face.tet)])] < kSmallestPiece_mm3) {
      about_small.insert(face.nodes);
    }
  }
  geometry::Facets kept;
  std::vector<int> kept_septa;
  double all_mm2 = 0.0, lost_mm2 = 0.0;
  for (std::size_t i = 0; i < facets.size(); ++i) {
    const double area = area_of(mesh.nodes, facets[i]);
    all_mm2 += area;
    if (about_small.count(facets[i]) != 0) {
      lost_mm2 += area;
      continue;
    }
    kept.push_back(facets[i]);
    kept_septa.push_back(septum_of[i]);
  }
  if (kept.size() < facets.size()) {
    add_note(notes, fmt::format("{}: {:.1f} cm2 of falx and tentorium would part tissue of less "
                                "than {:g} cc from the brain; they are left out{}",
                                kKey, lost_mm2 / 100.0, kSmallestPiece_mm3 / 1e3,
                                what_to_do(lost_mm2 / all_mm2, "falx and the tentorium")));
  }
  facets.swap(kept);
  septum_of.swap(kept_septa);
}

// Labels of values/brain_model.hpp.
void name_tissues(TetMesh& mesh, const Regions& regions, bool tissues) {
  if (!tissues) return mesh.labels.clear();
  for (int& label : mesh.labels) {
    switch (label) {
      case kLeftGrey:
      case kRightGrey: label = regions.tells_matter() ? kGreyMatter : 0; break;
      case kLeftWhite:
      case kRightWhite: label = kWhiteMatter; break;
      case kCerebellumRegion: label = kCerebellumLabel; break;
      case kBrainstemRegion: label = kBrainstemLabel; break;
      default: label = 0;
    }
  }
}

}  // namespace

Result<geometry::SlitMesh> with_septa_and_ventricles(const TetMesh& mesh, const Regions& regions,
                                                     const AnatomyConfig& wanted,
                                                     const TriangleSurface& tumour,
                                                     const std::string& what, Notes* notes) {
  const ClosedTumour inside_tumour = closed_tumour(tumour);
  std::vector<char> taken(at(mesh.num_tets()), 0);
  if (wanted.ventricles) {
    taken = cavities(mesh, notes);
    take_islands(mesh, taken, notes);
    if (Status kept = check_tumour(mesh, taken, inside_tumour, what); !kept) {
      return tl::unexpected(kept.error());
    }
  }
  geometry::Facets facets;
  std::vector<int> septum_of;
  if (wanted.septa) {
    std::vector<Edge> rim;
    const Eigen::Matrix3Xi outer = geometry::boundary_triangles(mesh);
    for (const auto& triangle : outer.colwise()) {
      Facet f{triangle[0], triangle[1], triangle[2]};
      std::sort(f.begin(), f.end());
      for (const Edge& edge : edges_of(f)) rim.push_back(edge);
    }
    std::sort(rim.begin(), rim.end());
    const std::array<geometry::Facets, 2> found =
        parted_facets(mesh, regions, taken, inside_tumour, notes);
    for (std::size_t s = 0; s < 2; ++s) {
      const geometry::Facets kept = without_teeth_and_islands(found[s], mesh.nodes, rim,
                                                              s == 0 ? "falx" : "tentorium", notes);
      facets.insert(facets.end(), kept.begin(), kept.end());
      septum_of.resize(facets.size(), static_cast<int>(s));
    }
    join_pieces(mesh, taken, facets, septum_of, notes);
    if (facets.empty()) {
      return fail(
          ErrorCode::kEmptySet,
          fmt::format("{}: no falx or tentorium: nowhere does cortex of the left hemisphere "
                      "lie beside cortex of the right one without tissue between them "
                      "(anatomy.septa: off leaves them out)",
                      what));
    }
  }
  geometry::SlitMesh cut = geometry::cut_mesh(mesh, taken, facets, septum_of);
  name_tissues(cut.mesh, regions, wanted.tissues);
  if (Status status = geometry::check_mesh(cut.mesh); !status) {
    return fail(status.error().code, fmt::format("{}: {}", what, status.error().message));
  }
  return cut;
}

}  // namespace brainshift::anatomy
