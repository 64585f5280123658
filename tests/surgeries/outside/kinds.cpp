// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/surgeries/outside/kinds.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "client/tools/twin/resection.hpp"
#include "common/core/statistics.hpp"
#include "common/core/units.hpp"
#include "common/fem/space_elasticity.hpp"
#include "tests/surgeries/outside/cavity.hpp"

namespace brainshift::outside {
namespace {

constexpr double kSoft = 0.1;  // where a blade or a tract parts tissue: factor of G

double between(Random& random, double low, double high) {
  return low + (high - low) * random.uniform();
}

Vec3 turned(const Vec3& direction, double angle_deg, Random& random) {
  const Vec3 axis = direction.cross(random.direction()).normalized();
  return Eigen::AngleAxisd(angle_deg * std::numbers::pi / 180.0, axis) * direction;
}

Vec3 across(const Vec3& direction, Random& random) {
  return direction.cross(random.direction()).normalized();
}

// The gravity of the case, wrong by up to 8 degrees.
Vec3 about_down(const OutsideHead& head, Random& random) {
  return turned(head.mesh->model.gravity_direction, between(random, 0.0, 8.0), random);
}

// Where air stands: above a plane across `down` that leaves `part` of the region's vertices above.
Region air(const OutsideHead& head, const Vec3& down, const Region& in, double part) {
  std::vector<double> depths;
  const Points& nodes = head.mesh->model.mesh.nodes;
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    if (in(nodes.col(i))) depths.push_back(down.dot(nodes.col(i)));
  }
  const double level = percentile(depths, 100.0 * part);
  return [=](const Vec3& x) { return in(x) && down.dot(x) < level; };
}

Event sag(const OutsideHead& head, Random& random, const Vec3& down, const Region& in, double part,
          double low_mm, double high_mm) {
  Event event;
  const Region where = air(head, down, in, part);
  event.load = [=](const fem::DisplacementSpace& space) { return weight_load(space, down, where); };
  event.largest_mm = between(random, low_mm, high_mm);
  return event;
}

Event air_in(const OutsideHead& head, Random& random, const Region& in) {
  const Vec3 down = about_down(head, random);
  return sag(head, random, down, in, between(random, 0.4, 0.8), 3.0, 9.0);
}

Region everywhere() {
  return [](const Vec3&) { return true; };
}
Region opened_half(const OutsideHead& head) {
  return [&head](const Vec3& x) { return head.side_of(x) > 0.0; };
}

Event air_both(const OutsideHead& head, Random& random) {
  return air_in(head, random, everywhere());
}

Event air_side(const OutsideHead& head, Random& random) {
  return air_in(head, random, opened_half(head));
}

Event air_side_partial(const OutsideHead& head, Random& random) {
  const double y = head.opening[1] + between(random, -10.0, 10.0);
  const double half = between(random, 0.14, 0.25) * head.extent()[1];
  return air_in(head, random, [&head, y, half](const Vec3& x) {
    return head.side_of(x) > 0.0 && std::abs(x[1] - y) < half;
  });
}

Event air_back(const OutsideHead& head, Random& random) {
  const double y = head.low[1] + between(random, 0.3, 0.45) * head.extent()[1];
  return air_in(head, random, [y](const Vec3& x) { return x[1] < y; });
}

Event air_front(const OutsideHead& head, Random& random) {
  const double y = head.high[1] - between(random, 0.3, 0.45) * head.extent()[1];
  return air_in(head, random, [y](const Vec3& x) { return x[1] > y; });
}

Event falx_sag(const OutsideHead& head, Random& random) {
  const bool one_side = random.uniform() < 0.5;
  Event event = air_in(head, random, one_side ? opened_half(head) : everywhere());
  event.changes.sheets = true;
  return event;
}

// Pressure of one in a region, pushing inwards for a negative sign.
std::function<Points(const fem::DisplacementSpace&)> pressed(const Region& in, double pressure) {
  return [=](const fem::DisplacementSpace& space) {
    return pressure_load(space, [&](const Vec3& x) { return in(x) ? pressure : 0.0; });
  };
}

// Of cavities the volume that their wall encloses; of soft ellipsoids what their strain says.
Event ventricles_drain(const OutsideHead& head, Random& random) {
  Event event;
  const int half = random.uniform() < 0.3 ? 1 : 0;
  if (head.has_cavities()) {
    const Wall wall = head.mesh->model.ventricle_wall;
    const CavityPart part{head.middle()[0], half * head.opening_side};
    event.load = [=](const fem::DisplacementSpace& space) {
      return suction_load(space, wall, part, 1e-4);
    };
    event.lost = [=](const fem::DisplacementSpace& space, const Points& u) {
      return cavity_loss(space, u, wall, part);
    };
  } else {
    const Region region = ventricles(head, half);
    event.load = pressed(region, -1e-4);
    event.lost = [=](const fem::DisplacementSpace& space, const Points& u) {
      return volume_loss(space, u, region);
    };
  }
  event.volume_loss = between(random, 0.3, 0.7);
  event.largest_mm = 14.0;
  return event;
}

// A place of the skull away from the opening: a vertex of walls or base that `fits`.
Vec3 place_of(const OutsideHead& head, Random& random, const Region& fits) {
  const BrainModel& body = head.mesh->model;
  std::vector<Vec3> places;
  for (const auto* nodes : {&body.slaves, &body.fixed}) {
    for (const NodeIndex node : *nodes) {
      const Vec3 x = body.mesh.nodes.col(node);
      if (x[2] > head.low[2] + 0.35 * head.extent()[2] && fits(x)) places.push_back(x);
    }
  }
  if (places.empty()) return head.middle() + 0.5 * head.extent()[2] * Vec3::UnitZ();
  return places[random.index(places.size())];
}

// Blood between skull and brain: pressure on the surface about a place, fading to its rim.
Event haematoma(const OutsideHead& head, Random& random, double side) {
  const double apart = 0.25 * head.extent()[1];
  const Vec3 place = place_of(head, random, [&](const Vec3& x) {
    return side * head.side_of(x) > 0.07 * head.extent()[0] && (x - head.opening).norm() > apart;
  });
  const double radius = between(random, 0.12, 0.2) * head.extent()[1];
  const auto faces = head.mesh->model.boundary_triangles;
  Event event;
  event.load = [=](const fem::DisplacementSpace& space) {
    Eigen::Matrix<int, 3, Eigen::Dynamic> near(3, faces.cols());
    Eigen::Index count = 0;
    Vec3 outward = Vec3::Zero();
    for (Eigen::Index f = 0; f < faces.cols(); ++f) {
      const Mat3 corners = space.mesh.nodes(Eigen::all, faces.col(f));
      if ((corners.rowwise().mean() - place).norm() > 1.3 * radius) continue;
      outward += Vec3(corners.col(1) - corners.col(0)).cross(Vec3(corners.col(2) - corners.col(0)));
      near.col(count++) = faces.col(f);
    }
    outward.normalize();
    return fem::traction_load(space, near.leftCols(count), [&](const Vec3& x) -> Vec3 {
      const double rest = 1.0 - (x - place).squaredNorm() / (radius * radius);
      return rest > 0.0 ? Vec3(-1e-3 * rest * outward) : Vec3(Vec3::Zero());
    });
  };
  event.largest_mm = between(random, 6.0, 10.0);
  return event;
}
Event haematoma_same(const OutsideHead& head, Random& random) {
  return haematoma(head, random, 1.0);
}
Event haematoma_other(const OutsideHead& head, Random& random) {
  return haematoma(head, random, -1.0);
}

// Two plates that part tissue: forces along +-aside on both sides of a slit, within `blade`.
Event blade(const Vec3& on, const Vec3& aside, const Region& blade, double other, double reach_mm,
            double largest_mm) {
  Event event;
  event.load = [=](const fem::DisplacementSpace& space) {
    return fem::body_load(space, fem::VectorField([=](const Vec3& x) -> Vec3 {
                            const double beside = aside.dot(x - on);
                            if (!blade(x) || std::abs(beside) > reach_mm) return Vec3::Zero();
                            return 1e-4 * (beside > 0.0 ? 1.0 : -other) * aside;
                          }));
  };
  event.changes.softer = [=](const Vec3& x) {
    return blade(x) && std::abs(aside.dot(x - on)) < 0.5 * reach_mm ? kSoft : 1.0;
  };
  event.largest_mm = largest_mm;
  return event;
}

// Between the hemispheres, from the top: the opened half is drawn aside, the other yields less.
Event blade_midline(const OutsideHead& head, Random& random) {
  const double width = between(random, 0.05, 0.08) * head.extent()[1];
  const double y =
      std::clamp(head.opening[1] + between(random, -15.0, 15.0),
                 head.low[1] + 0.2 * head.extent()[1], head.high[1] - 0.2 * head.extent()[1]);
  const double depth = between(random, 0.25, 0.4) * head.extent()[2];
  const double other = between(random, 0.0, 0.5);
  double top = head.low[2];
  const Points& nodes = head.mesh->model.mesh.nodes;
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    if (std::abs(nodes(0, i) - head.middle()[0]) < 15.0 && std::abs(nodes(1, i) - y) < 15.0) {
      top = std::max(top, nodes(2, i));
    }
  }
  return blade(
      head.middle(), head.opening_side * Vec3::UnitX(),
      [=](const Vec3& x) { return std::abs(x[1] - y) < width && x[2] > top - depth; }, other, 10.0,
      between(random, 4.0, 13.8));
}

// Along a way from the opening to the tumour.
Event blade_tract(const OutsideHead& head, Random& random) {
  const Vec3 way = head.tumour - head.opening, axis = way.normalized();
  const Vec3 aside = across(axis, random), along = axis.cross(aside);
  const double length = way.norm(), width = between(random, 8.0, 12.0);
  const Vec3 from = head.opening;
  return blade(
      from, aside,
      [=](const Vec3& x) {
        const double depth = axis.dot(x - from);
        return depth > -5.0 && depth < length && std::abs(along.dot(x - from)) < width;
      },
      1.0, 9.0, between(random, 3.0, 8.0));
}

// The superficial part of the tumour is gone, and the walls fall in: what held them pulls.
Event cavity(const OutsideHead& head, Random& random) {
  Event event = air_in(head, random, everywhere());
  event.resected_fraction = between(random, 0.6, 0.9);
  event.largest_mm = between(random, 4.0, 9.0);
  BrainModel intact = head.mesh->model;
  intact.mesh.labels.clear();
  const auto resected = client::resect(intact, head.config, {*event.resected_fraction});
  if (!resected) return event;  // no element in the tumour
  for (const int label : resected->model.mesh.labels) event.changes.cavity.push_back(label == 1);
  const double suction = units::stress_from_pa(between(random, 150.0, 600.0));
  const auto gone = std::make_shared<std::vector<char>>(event.changes.cavity);
  const auto weight = event.load;
  event.load = [=](const fem::DisplacementSpace& space) -> Points {
    Points load = weight(space);
    for (int e = 0; e < space.num_elements(); ++e) {
      if ((*gone)[static_cast<std::size_t>(e)] == 0) continue;
      const fem::TetGeometry tet = fem::tet_geometry(space.mesh, e);
      for (const fem::TetPoint& q : fem::fine_tet_rule()) {
        const auto g = fem::shape_gradients(space.element, tet.gradients, q.l);
        for (int k = 0; k < g.cols(); ++k) {
          load.col(space.elements(k, e)) -= suction * q.weight * tet.volume * g.col(k);
        }
      }
    }
    return load;
  };
  return event;
}

// Raised pressure, more of it about a place deep in the brain.
std::function<Points(const fem::DisplacementSpace&)> raised(const OutsideHead& head,
                                                            Random& random) {
  const Vec3 place = head.middle() + 0.15 * random.direction().cwiseProduct(head.extent()) +
                     Vec3(0.0, 0.0, 0.1 * head.extent()[2]);
  const double width = between(random, 0.12, 0.3) * head.extent()[1];
  const double share = between(random, 0.3, 3.0);
  return [=](const fem::DisplacementSpace& space) {
    return pressure_load(space, [&](const Vec3& x) {
      return 1e-4 * (1.0 + share * std::exp(-0.5 * (x - place).squaredNorm() / (width * width)));
    });
  };
}

Event bulge(const OutsideHead& head, Random& random) {
  Event event;
  event.load = raised(head, random);
  event.largest_mm = between(random, 3.0, 9.0);
  return event;
}

// Another window of the skull while the brain bulges.
Event second_opening(const OutsideHead& head, Random& random) {
  Event event = bulge(head, random);
  const double near = 0.2 * head.extent()[1], far = 0.45 * head.extent()[1];
  const Vec3 place = place_of(head, random, [&](const Vec3& x) {
    const double apart = (x - head.opening).norm();
    return apart > near && apart < far;
  });
  const double radius = between(random, 14.0, 22.0);
  event.no_wall = [=](const Vec3& x) { return (x - place).norm() < radius; };
  return event;
}

// The patient is turned and nobody tells: gravity, and where air stands, are others.
Event repositioned(const OutsideHead& head, Random& random) {
  const Vec3 down = turned(head.mesh->model.gravity_direction, between(random, 20.0, 60.0), random);
  return sag(head, random, down, everywhere(), between(random, 0.3, 0.7), 3.0, 10.0);
}

Event large_strain(const OutsideHead& head, Random& random) {
  const Vec3 down = turned(head.mesh->model.gravity_direction, between(random, 0.0, 25.0), random);
  Event event = sag(head, random, down, everywhere(), between(random, 0.5, 0.9), 10.0, 14.0);
  event.steps = 5;
  return event;
}

}  // namespace

const std::vector<Kind>& all_kinds() {
  static const std::vector<Kind> kinds = {
      {"air-side", "air on the opened side only", air_side},
      {"air-side-partial", "air about the opening, on its side only", air_side_partial},
      {"air-back", "air at the back", air_back},
      {"air-front", "air at the front", air_front},
      {"falx-sag", "sag of both halves or the opened one; falx and tentorium hold", falx_sag},
      {"ventricles-drain", "one or both lateral ventricles lose 30 to 70 %", ventricles_drain},
      {"haematoma-same", "blood presses from the skull, on the side of the opening",
       haematoma_same},
      {"haematoma-other", "blood presses from the skull, on the other side", haematoma_other},
      {"blade-midline", "a blade between the hemispheres", blade_midline},
      {"blade-tract", "blades along a tract to the tumour", blade_tract},
      {"cavity", "60 to 90 % of the tumour are gone, and the walls fall in", cavity},
      {"second-opening", "raised pressure, and a second window of the skull", second_opening},
      {"repositioned", "sag of a patient turned by 20 to 60 degrees, which nobody tells",
       repositioned},
      {"bulge", "raised pressure", bulge},
      {"large-strain", "sag of 10 to 14 mm on geometry that follows the load", large_strain}};
  return kinds;
}

const Kind* find_kind(const std::string& name) {
  for (const Kind& kind : all_kinds()) {
    if (kind.name == name) return &kind;
  }
  return nullptr;
}

const Kind& plain_sag() {
  static const Kind kind{"sag", "air above both halves", air_both};
  return kind;
}

Points weight_load(const fem::DisplacementSpace& space, const Vec3& down, const Region& in) {
  const Vec3 weight = units::weight_density_from_kg_m3(1000.0) * down;
  return fem::body_load(space, fem::VectorField([&](const Vec3& x) -> Vec3 {
                          return in(x) ? weight : Vec3(Vec3::Zero());
                        }));
}

Points pressure_load(const fem::DisplacementSpace& space,
                     const std::function<double(const Vec3&)>& pressure) {
  Points load = Points::Zero(3, space.num_nodes());
  for (int e = 0; e < space.num_elements(); ++e) {
    const fem::TetGeometry tet = fem::tet_geometry(space.mesh, e);
    const Eigen::Matrix<double, 3, 4> corners =
        space.mesh.nodes(Eigen::all, space.mesh.tets.col(e));
    for (const fem::TetPoint& q : fem::fine_tet_rule()) {
      const double p = q.weight * tet.volume * pressure(corners * q.l);
      if (p == 0.0) continue;
      const auto g = fem::shape_gradients(space.element, tet.gradients, q.l);
      for (int k = 0; k < g.cols(); ++k) load.col(space.elements(k, e)) += p * g.col(k);
    }
  }
  return load;
}

double volume_loss(const fem::DisplacementSpace& space, const Points& u, const Region& region) {
  double volume = 0.0, lost = 0.0;
  for (int e = 0; e < space.num_elements(); ++e) {
    const Vec3 x = space.mesh.nodes(Eigen::all, space.mesh.tets.col(e)).rowwise().mean();
    if (!region(x)) continue;
    const double v = fem::tet_geometry(space.mesh, e).volume;
    volume += v;
    const Eigen::Vector4d centre = Eigen::Vector4d::Constant(0.25);
    lost -= v * fem::displacement_gradient(space, u, e, centre).trace();
  }
  return volume > 0.0 ? lost / volume : 0.0;
}

}  // namespace brainshift::outside
