// SPDX-License-Identifier: GPL-3.0-or-later
// ForwardProblem and ForwardSolution: one elastic body on any tetrahedral mesh, with its
// conditions, and the solution.
//
//   div sigma(u) + b = 0 in the body
//   u or sigma n = t on parts of its boundary, contact with rigid obstacles on others
//
// Small strains. Without steps_s: drained steady state. With steps_s: consolidation from rest
// (fem/biot.hpp), where all loads act from t = 0 on, and boundaries without a prescribed pore
// pressure are sealed. Units mm, N. Conditions and contacts name groups. Each has a name of its
// own, and messages begin with it ("conditions.NAME: ...", "contact.NAME: ...").
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/contact/surface_contact.hpp"
#include "common/core/error.hpp"
#include "common/core/progress.hpp"
#include "common/core/types.hpp"
#include "common/fem/displacement_space.hpp"
#include "common/fem/space_elasticity.hpp"

namespace brainshift::forward {

// Check that a body cannot move rigidly. It looks at the directions that are held, not at a
// pivot.

// The displacement of `place` along unit `direction` is held.
struct HeldDirection {
  Vec3 place;
  Vec3 direction;
};

// Ok when the directions hold all six rigid motions; otherwise kFloatingBody, with the number of
// motions that are free. Rotations are weighted by the size of the body (mm), so that the answer
// does not depend on the unit of length.
Status check_support(const std::vector<HeldDirection>& held, const Vec3& centre, double size_mm);

// Part of the boundary. vertices: may hold some that belong to no face. faces: 3 x f vertices,
// oriented outwards. inner: faces inside the body, which have no outward side; only displacements
// can be prescribed on them.
struct FaceGroup {
  std::vector<NodeIndex> vertices;
  Eigen::Matrix<int, 3, Eigen::Dynamic> faces, inner;
};

// Components that are set are prescribed at the group's nodes, mm.
struct Displacement {
  std::array<std::optional<double>, 3> components;
};
struct DisplacementField {
  fem::VectorField u;
};
// n . u = value (0: free to slide, exactly), with n the mean nodal normal of this group alone.
// Flat faces that meet at an angle need one group each.
struct NormalDisplacement {
  double value = 0.0;
};
struct Traction {
  fem::VectorField t;  // N/mm^2
};
// Pressure against the outward normal, N/mm^2.
struct Pressure {
  double value = 0.0;
};

// Prescribed pore pressure, N/mm^2; 0: drained. Problems with time steps only.
struct PorePressure {
  double value = 0.0;
};

struct Condition {
  std::string name, group;
  std::variant<Displacement, DisplacementField, NormalDisplacement, Traction, Pressure,
               PorePressure>
      what;
};

struct Contact {
  std::string name, group;
  contact::Obstacle obstacle;
  std::optional<double> penalty;  // kappa, N/mm^3; default: default_penalty()
};

struct ForwardProblem {
  TetMesh mesh;
  fem::Element element = fem::Element::kP2;
  fem::MaterialMap materials;
  Points body_force;            // N/mm^3, 3 x tets; no column: none
  fem::VectorField body_field;  // N/mm^3, added where set
  std::map<std::string, FaceGroup> groups;
  std::vector<Condition> conditions;
  std::vector<Contact> contacts;
  std::vector<double> steps_s;  // lengths of time steps; element P1, no contacts
};

struct ContactResult {
  std::string name;
  int points = 0, active = 0;       // quadrature points
  Vec3 force = Vec3::Zero();        // on the body, N
  double area_mm2 = 0.0;            // of the active points
  double max_penetration_mm = 0.0;  // that the penalty leaves
  double max_pressure = 0.0;        // N/mm^2
};

struct ForwardSolution {
  fem::DisplacementSpace space;
  Points displacement;             // 3 x nodes, mm
  Eigen::MatrixXd element_stress;  // 6 x tets, at the centroids, N/mm^2 (xx yy zz xy yz xz)
  Eigen::MatrixXd nodal_stress;    // 6 x nodes, averaged
  VecX contact_pressure;           // at vertices, N/mm^2; no entry without contact
  std::vector<ContactResult> contacts;
  // Consolidation: state after every step; the last one is `displacement` above.
  struct Moment {
    double time_s = 0.0;
    Points displacement;  // 3 x n, mm
    VecX pore_pressure;   // n, N/mm^2
  };
  std::vector<Moment> history;
  Vec3 reaction = Vec3::Zero();  // sum over prescribed displacements, N
  // Diagnostics.
  int unknowns = 0, iterations = 0;
  double relative_residual = 0.0, rcond = 0.0, min_jacobian = 0.0;
  std::vector<std::string> warnings;
  double assemble_s = 0.0, solve_s = 0.0;
};

// Ok, or the first error of the problem itself, missing support included (kFloatingBody).
Status validate(const ForwardProblem& problem);

// kappa = 100 E / h, with E of the stiffest tissue at the group and h its mean edge. The
// penetration that remains is below a hundredth of the compression of one edge.
double default_penalty(const ForwardProblem& problem, const FaceGroup& group);

// The discrete problem that every solver starts from: nodes, prescribed displacements, and the
// consistent nodal forces (3 x n, N) of body forces, tractions and pressures, without contact.
// Errors as validate; kInvalidArgument for prescribed displacements that contradict each other.
struct Discretised {
  fem::DisplacementSpace space;
  fem::DisplacementConstraints constraints;
  Points load;
  std::map<NodeIndex, double> pore_pressure;  // prescribed, N/mm^2
};
Result<Discretised> discretise(const ForwardProblem& problem);

// kInvalidArgument, kFloatingBody, kSingularMatrix, kNotFinite, kNotConverged.
Result<ForwardSolution> solve(const ForwardProblem& problem, const Progress& progress = {});

// Values at points. kInvalidArgument: a point lies more than tolerance_mm outside.
struct ProbeValue {
  Vec3 displacement = Vec3::Zero();
  double contact_pressure = 0.0;  // N/mm^2, of the nearest face point, 0 away from contact
  double pore_pressure = 0.0;     // N/mm^2, 0 without time steps
};
Result<std::vector<ProbeValue>> probe(const ForwardSolution& solution, const Points& points,
                                      double tolerance_mm);
// The same after step `moment` (0 is the first) of a consolidation.
Result<std::vector<ProbeValue>> probe(const ForwardSolution& solution, std::size_t moment,
                                      const Points& points, double tolerance_mm);

}  // namespace brainshift::forward
