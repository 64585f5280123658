// SPDX-License-Identifier: GPL-3.0-or-later
// The head in which truths from outside happen: quadratic elements on a mesh of its own, tissues
// and supports that no estimate believes.
//
//   mesh        meshed anew with edges kOtherEdge times as long (client/tools/twin/other_mesh.hpp);
//               heads below kOwnMesh nodes: the case's own mesh. Quadratic elements in both.
//   tissue      G = G0 exp(0.2 a) f exp(0.3 z(x)): a standard normal of the patient, f of the
//               tissue, z a Gaussian field over 20 mm. Uniform f: grey (within 4 mm of the surface)
//               0.8 to 1.1, white 1.1 to 1.5, tumour 0.8 to 2.5, ventricles 0.04 to 0.08 with
//               Poisson ratio 0.3. Poisson ratio elsewhere 0.45 to 0.48.
//   base        below the second plane the brain lies on springs: fluid and arachnoid over the base
//               of the skull, 0.5 exp(0.5 a) kPa/mm along the normal, a tenth across it. (The
//               estimate lets it slide on a rigid base.)
//   brainstem   held by springs of 1 kPa/mm along every direction. (The estimate lets it free.)
//   walls       above the second plane: the skull, 0.3 to 2.5 mm away, varying over 30 mm, and
//               arachnoid springs of 0.01 kPa/mm. (The estimate believes a gap of 1 mm.)
//   opening     free
//   falx, tentorium   where a kind asks for them: nodes of the sheet are held along its normal
//
// A case whose label map tells its anatomy (anatomy.labels) has its own sheets and ventricles here,
// in this mesh:
//
//   falx, tentorium   of every kind: walls on both sides of a slit, 0.2 to 1.2 mm away, varying
//                     over 30 mm (the estimate believes 0.5 mm), without springs
//   ventricles        cavities; no tissue is soft instead. Grey matter lies along slits too, and
//                     not along the cavities
//
// Lengths that depend on the head are parts of its extents. All draws are uniform unless stated.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "client/tools/twin/other_mesh.hpp"
#include "common/configuration/case_config.hpp"
#include "tests/surgeries/outside/contact_body.hpp"

namespace brainshift::outside {

using Region = std::function<bool(const Vec3&)>;

inline constexpr int kOwnMesh = 4000;

struct OutsideHead {
  std::shared_ptr<const client::OtherMesh> mesh;
  CaseConfig config;
  Vec3 low, high;          // of the brain's extent, mm
  double opening_side;     // +1 or -1: the sign of x - middle() at the opening
  Vec3 opening, tumour;    // centres, mm
  Points opening_nodes;    // 3 x m
  std::vector<char> grey;  // per element
  std::vector<char> in_tumour;

  Vec3 middle() const { return 0.5 * (low + high); }
  Vec3 extent() const { return high - low; }
  double side_of(const Vec3& x) const { return opening_side * (x[0] - middle()[0]); }
  const fem::DisplacementSpace& space() const { return mesh->space; }
  bool has_sheets() const { return mesh->model.septa.triangles.cols() > 0; }
  bool has_cavities() const { return mesh->model.ventricle_wall.cols() > 0; }
};

// model, config: the case as the estimate knows it. Errors of mesh_anew, make_other_mesh,
// geometry::ClosestPointIndex.
Result<OutsideHead> make_outside_head(const BrainModel& model, const CaseConfig& config);

// Two ellipsoids beside the middle, about as large as the bodies of lateral ventricles.
// half: -1 or +1, that of the opening; 0: both.
Region ventricles(const OutsideHead& head, int half);
// The sheet between the halves: the outer ring of the sagittal plane above its middle; and one
// across the back half, rising forwards, between cerebrum and cerebellum.
bool on_falx(const OutsideHead& head, const Vec3& x, double half_width_mm);
bool on_tentorium(const OutsideHead& head, const Vec3& x, double half_width_mm);
Vec3 tentorium_normal();

// What a surgery does to tissue and supports.
struct Changes {
  std::function<double(const Vec3&)> softer;  // factor of G at an element's centre; empty: none
  std::vector<char> cavity;                   // per element; empty: none. Nothing is left there.
  bool sheets = false;                        // falx and tentorium hold, in a head without its own
  bool plain() const { return !softer && cavity.empty() && !sheets; }
};

// The same seed gives the same tissue, springs and gaps, whatever the changes.
fem::MaterialMap tissue_of(const OutsideHead& head, const Changes& changes, std::uint64_t seed);
Supports supports_of(const OutsideHead& head, const Changes& changes, std::uint64_t seed);

}  // namespace brainshift::outside
