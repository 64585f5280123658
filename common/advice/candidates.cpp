// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/advice/candidates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "common/core/small_matrices.hpp"
#include "common/geometry/surface.hpp"
#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/table.hpp"
#include "common/registration/surface_distances.hpp"

namespace brainshift::advice {
namespace {

constexpr std::uint64_t kSeed = 20100401;  // any fixed number: the same model, the same places
constexpr int kFewestPlaces = 50;          // of a sweep or a patch

// Directions that are at least this part of an offset are named.
constexpr double kNamedPart = 0.38;

std::string side_of(const Vec3& offset) {
  constexpr const char* kWords[3][2] = {
      {"left", "right"}, {"posterior", "anterior"}, {"inferior", "superior"}};
  std::string words;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(offset[axis]) < kNamedPart * offset.norm()) continue;
    words += std::string(words.empty() ? "" : " ") + kWords[axis][offset[axis] > 0.0 ? 1 : 0];
  }
  return words;
}

Points places_on(const TriangleSurface& surface) {
  if (surface.num_triangles() == 0) return Points(3, 0);
  const auto count = static_cast<int>(std::lround(kPointsPerMm2 * geometry::area(surface)));
  return count > 0 ? geometry::sample_surface(surface, count, kSeed) : Points(3, 0);
}

Points where(const Points& places, const std::function<bool(const Vec3&)>& chosen) {
  std::vector<int> columns;
  for (int i = 0; i < places.cols(); ++i) {
    if (chosen(places.col(i))) columns.push_back(i);
  }
  return places(Eigen::all, columns);
}

Vec3 nearest(const Points& places, const Vec3& to) {
  Eigen::Index best = 0;
  (places.colwise() - to).colwise().squaredNorm().minCoeff(&best);
  return places.col(best);
}

Candidate touched(std::string name, const Vec3& place) {
  return {std::move(name), Kind::kPoint, place.replicate(1, kTouches)};
}

void add(Candidate candidate, std::vector<Candidate>& candidates) {
  const std::string plain = candidate.name;
  for (int again = 2; std::any_of(candidates.begin(), candidates.end(),
                                  [&](const Candidate& o) { return o.name == candidate.name; });
       ++again) {
    candidate.name = fmt::format("{} ({})", plain, again);
  }
  candidates.push_back(std::move(candidate));
}

void add_sectors(const BrainModel& model, std::vector<Candidate>& candidates) {
  const Points places = places_on(model.tumour);
  if (places.cols() == 0) return;
  const Vec3 centre = places.rowwise().mean();
  for (int octant = 0; octant < 8; ++octant) {
    const Vec3 sides(octant & 1 ? 1 : -1, octant & 2 ? 1 : -1, octant & 4 ? 1 : -1);
    Points sector = where(places, [&](const Vec3& x) {
      return (((x - centre).array() >= 0.0) == (sides.array() > 0.0)).all();
    });
    if (sector.cols() < kFewestPlaces) continue;
    add({"tumour boundary, " + side_of(sides), Kind::kSweep, std::move(sector)}, candidates);
  }
}

void add_cortex(const BrainModel& model, std::vector<Candidate>& candidates) {
  const Points places = places_on(registration::craniotomy_patch(model).surface);
  if (places.cols() == 0) return;
  const Vec3 centre = places.rowwise().mean();
  const Points offsets = places.colwise() - centre;
  const auto axes = symmetric_eigen(Mat3(offsets * offsets.transpose()));
  std::vector<Candidate> forks;
  for (int quadrant = 0; quadrant < 4; ++quadrant) {
    const Vec3 along = axes.vectors.col(2), across = axes.vectors.col(1);
    Points patch = where(places, [&](const Vec3& x) {
      return (along.dot(x - centre) >= 0.0) == ((quadrant & 1) != 0) &&
             (across.dot(x - centre) >= 0.0) == ((quadrant & 2) != 0);
    });
    if (patch.cols() < kFewestPlaces) continue;
    const Vec3 middle = patch.rowwise().mean();
    const std::string side = side_of(middle - centre);
    forks.push_back(touched("vessel fork, cortex, " + side, nearest(patch, middle)));
    add({"cortex, " + side, Kind::kCortex, std::move(patch)}, candidates);
  }
  for (Candidate& fork : forks) add(std::move(fork), candidates);
  if (model.tumour.num_vertices() > 0) {
    add(touched("pointer, tumour below the opening", nearest(model.tumour.vertices, centre)),
        candidates);
  }
}

}  // namespace

std::string_view to_string(Kind kind) {
  constexpr std::string_view kNames[] = {"sweep", "cortex", "point"};
  return kNames[static_cast<int>(kind)];
}

std::vector<Candidate> default_candidates(const BrainModel& model) {
  std::vector<Candidate> candidates;
  add_sectors(model, candidates);
  add_cortex(model, candidates);
  return candidates;
}

Observation observed(const Candidate& candidate, const Points& displacement) {
  Observation observation;
  observation.source = "advice";
  observation.sequence = 1;
  const Points now = candidate.places + displacement;
  if (candidate.kind == Kind::kSweep) {
    observation.body = TumourBoundary{now, 0.0};
  } else if (candidate.kind == Kind::kCortex) {
    observation.body = CorticalSurface{TriangleSurface{now, {}}, 0.0};
  } else {
    observation.body = LandmarkPairs{candidate.places, now, 0.0};
  }
  return observation;
}

Result<std::vector<Candidate>> read_candidates(const std::filesystem::path& path,
                                               const BrainModel& model) {
  const auto content = io::read_text(path);
  if (!content) return tl::unexpected(content.error());
  const io::Table table = io::parse_table(*content);
  const auto wrong = [&](const io::TableRow& row, const std::string& what) {
    return io::unreadable(path, fmt::format("line {}: {}", row.line, what));
  };
  if (!table.heading) {
    return io::unreadable(path, "has no heading: must be name,kind,x,y,z,radius_mm");
  }
  const auto names = table.heading->name_column(), kinds = table.heading->column({"kind"}),
             radii = table.heading->column({"radius"}, {"mm"});
  const auto place = table.heading->place();
  if (!names || !kinds || !place || !radii) {
    return wrong(table.heading_row,
                 fmt::format("\"{}\" must be name,kind,x,y,z,radius_mm", table.heading_row.text));
  }
  const Points boundary = places_on(model.tumour);
  const Points cortex = places_on(registration::craniotomy_patch(model).surface);
  std::vector<Candidate> candidates;
  std::set<std::string> known;
  for (const io::TableRow& row : table.rows) {
    if (row.cells.size() < table.heading->size()) {
      return wrong(row, fmt::format("\"{}\" has {} of {} cells", row.text, row.cells.size(),
                                    table.heading->size()));
    }
    const std::string &name = row.cells[*names], &kind = row.cells[*kinds];
    const auto centre = place->of(row.cells);
    if (!centre) return wrong(row, fmt::format("\"{}\" is no place in mm", row.text));
    if (name.empty() || !known.insert(name).second) {
      return wrong(
          row, fmt::format("the name \"{}\" is {}", name, name.empty() ? "empty" : "there twice"));
    }
    if (kind == to_string(Kind::kPoint)) {
      candidates.push_back(touched(name, *centre));
      continue;
    }
    if (kind != to_string(Kind::kSweep) && kind != to_string(Kind::kCortex)) {
      return wrong(row, fmt::format("kind is \"{}\": must be sweep, cortex or point", kind));
    }
    double radius = 0.0;
    if (!io::parse_number(row.cells[*radii], radius) || !(radius > 0.0)) {
      return wrong(
          row, fmt::format("radius_mm is \"{}\": must be a number above 0 mm", row.cells[*radii]));
    }
    const bool sweep = kind == to_string(Kind::kSweep);
    Points near = where(sweep ? boundary : cortex,
                        [&](const Vec3& x) { return (x - *centre).norm() <= radius; });
    if (near.cols() < kFewestPlaces) {
      return wrong(row, fmt::format("{} mm2 of the {} lie within {} mm of the place: {} are the "
                                    "fewest",
                                    near.cols(), sweep ? "tumour's boundary" : "exposed cortex",
                                    radius, kFewestPlaces));
    }
    candidates.push_back({name, sweep ? Kind::kSweep : Kind::kCortex, std::move(near)});
  }
  if (candidates.empty()) return io::file_error(ErrorCode::kEmptySet, path, "names no candidate");
  return candidates;
}

}  // namespace brainshift::advice
