// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/tools/cli/command.hpp"
#include "common/forward/build_problem.hpp"
#include "common/io/config/problem_file.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/files/output_path.hpp"
#include "common/io/geometry/mesh_file.hpp"
#include "common/io/geometry/mesh_writer.hpp"

namespace brainshift::client {
namespace {

struct SolveArguments {
  std::filesystem::path problem, out, probes;
  bool json = false;
};

constexpr double kPaPerMegapascal = 1e6;
// A probe this far outside the mesh, relative to its size, is rounding
// of what should lie on the surface.
constexpr double kProbeTolerance = 1e-6;

double mesh_size(const TetMesh& mesh) {
  return (mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff()).norm();
}

// The files that a problem names, and the problem that they make.
Result<forward::ForwardProblem> load(const ProblemSpec& spec) {
  const auto of_key = [&](const std::string& key, const Error& error) {
    return tl::unexpected(
        io::locate_in_problem(spec.file, {error.code, key + ": " + error.message}));
  };
  auto mesh = io::read_grouped_mesh(spec.mesh);
  if (!mesh) return of_key("mesh.file", mesh.error());
  std::vector<TriangleSurface> surfaces;
  for (const ContactSpec& contact : spec.contact) {
    const auto* surface = std::get_if<SurfaceObstacleSpec>(&contact.obstacle);
    if (surface == nullptr) continue;
    auto read = io::read_surface(surface->file);
    if (!read) return of_key("contact." + contact.name + ".surface", read.error());
    surfaces.push_back(std::move(*read));
  }
  auto problem = forward::build_problem(spec, std::move(*mesh), surfaces);
  if (!problem) return tl::unexpected(io::locate_in_problem(spec.file, problem.error()));
  return problem;
}

Result<std::vector<forward::ProbeValue>> probe_values(const ProblemSpec& spec,
                                                      const forward::ForwardSolution& solution,
                                                      std::optional<std::size_t> moment = {}) {
  Points points(3, static_cast<Eigen::Index>(spec.probes.size()));
  for (std::size_t i = 0; i < spec.probes.size(); ++i)
    points.col(static_cast<Eigen::Index>(i)) = spec.probes[i].at_mm;
  const double tolerance_mm = kProbeTolerance * mesh_size(solution.space.mesh);
  return moment ? forward::probe(solution, *moment, points, tolerance_mm)
                : forward::probe(solution, points, tolerance_mm);
}

// The values at the end and, for a problem with time steps, after each of them.
struct Probed {
  std::vector<forward::ProbeValue> end;
  std::vector<std::vector<forward::ProbeValue>> after_step;
};
Result<Probed> probe_all(const ProblemSpec& spec, const forward::ForwardSolution& solution) {
  Probed probed;
  auto end = probe_values(spec, solution);
  if (!end) return tl::unexpected(end.error());
  probed.end = std::move(*end);
  for (std::size_t moment = 0; moment < solution.history.size(); ++moment) {
    auto values = probe_values(spec, solution, moment);
    if (!values) return tl::unexpected(values.error());
    probed.after_step.push_back(std::move(*values));
  }
  return probed;
}

// Before the work: a probe outside the mesh is found here.
Status check_probes(const ProblemSpec& spec, const TetMesh& mesh) {
  forward::ForwardSolution at_rest;
  at_rest.space = fem::make_space(mesh, fem::Element::kP1);
  at_rest.displacement = Points::Zero(3, mesh.num_nodes());
  for (const ProbeSpec& probe : spec.probes) {
    const auto value = forward::probe(at_rest, probe.at_mm, kProbeTolerance * mesh_size(mesh));
    if (value) continue;
    return tl::unexpected(io::locate_in_problem(
        spec.file, {value.error().code, "probes." + probe.name + ": " + value.error().message}));
  }
  return {};
}

Status write_field(const std::filesystem::path& out, const forward::ForwardSolution& solution) {
  std::vector<io::NodeField> nodes = {{"displacement", solution.displacement},
                                      {"stress_pa", kPaPerMegapascal * solution.nodal_stress}};
  std::vector<io::NodeField> cells = {{"stress_pa", kPaPerMegapascal * solution.element_stress}};
  Eigen::MatrixXd mises(1, solution.element_stress.cols());
  for (Eigen::Index e = 0; e < mises.cols(); ++e) {
    mises(0, e) = kPaPerMegapascal * fem::von_mises(solution.element_stress.col(e));
  }
  cells.push_back({"von_mises_pa", mises});
  if (solution.contact_pressure.size() > 0) {
    // Linear in between, on edges too.
    Eigen::MatrixXd pressure(1, solution.space.num_nodes());
    const int vertices = solution.space.num_vertices();
    pressure.leftCols(vertices) = kPaPerMegapascal * solution.contact_pressure.transpose();
    for (std::size_t e = 0; e < solution.space.edges.size(); ++e) {
      const auto& [a, b] = solution.space.edges[e];
      pressure(0, vertices + static_cast<Eigen::Index>(e)) =
          0.5 * (pressure(0, a) + pressure(0, b));
    }
    nodes.push_back({"contact_pressure_pa", pressure});
  }
  if (!solution.history.empty()) {
    nodes.push_back(
        {"pore_pressure_pa", kPaPerMegapascal * solution.history.back().pore_pressure.transpose()});
  }
  return io::write_vtu(out,
                       {solution.space.nodes, solution.space.elements, solution.space.mesh.labels},
                       nodes, cells);
}

Status write_probes(const std::filesystem::path& path, const ProblemSpec& spec,
                    const forward::ForwardSolution& solution, const Probed& values) {
  const auto row = [&](std::size_t i, const forward::ProbeValue& value) {
    const Vec3& x = spec.probes[i].at_mm;
    const Vec3& u = value.displacement;
    return fmt::format("{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}", spec.probes[i].name,
                       x[0], x[1], x[2], u[0], u[1], u[2],
                       kPaPerMegapascal * value.contact_pressure);
  };
  std::string csv = "name,x_mm,y_mm,z_mm,ux_mm,uy_mm,uz_mm,contact_pressure_pa";
  csv += solution.history.empty() ? "\n" : ",time_s,pore_pressure_pa\n";
  for (std::size_t i = 0; i < spec.probes.size(); ++i) {
    if (solution.history.empty()) csv += row(i, values.end[i]) + "\n";
    for (std::size_t k = 0; k < solution.history.size(); ++k) {
      const forward::ProbeValue& value = values.after_step[k][i];
      csv += fmt::format("{},{:.9g},{:.9g}\n", row(i, value), solution.history[k].time_s,
                         kPaPerMegapascal * value.pore_pressure);
    }
  }
  return io::write_file(path, csv);
}

nlohmann::json array_of(const Vec3& v) { return {v[0], v[1], v[2]}; }

const char* name_of(fem::Element element) { return element == fem::Element::kP1 ? "p1" : "p2"; }

nlohmann::json summary(const ProblemSpec& spec, const forward::ForwardSolution& solution,
                       const Probed& values) {
  nlohmann::json json = {{"problem", spec.file.string()},
                         {"element", name_of(solution.space.element)},
                         {"nodes", solution.space.num_nodes()},
                         {"tets", solution.space.num_elements()},
                         {"unknowns", solution.unknowns},
                         {"iterations", solution.iterations},
                         {"relative_residual", solution.relative_residual},
                         {"rcond", solution.rcond},
                         {"min_jacobian", solution.min_jacobian},
                         {"max_displacement_mm", solution.displacement.colwise().norm().maxCoeff()},
                         {"reaction_n", array_of(solution.reaction)},
                         {"warnings", solution.warnings},
                         {"assemble_s", solution.assemble_s},
                         {"solve_s", solution.solve_s},
                         {"contact", nlohmann::json::array()},
                         {"probes", nlohmann::json::array()}};
  for (const forward::ContactResult& c : solution.contacts) {
    json["contact"].push_back({{"name", c.name},
                               {"points", c.points},
                               {"active", c.active},
                               {"force_n", array_of(c.force)},
                               {"area_mm2", c.area_mm2},
                               {"max_pressure_pa", kPaPerMegapascal * c.max_pressure},
                               {"max_penetration_mm", c.max_penetration_mm}});
  }
  for (std::size_t i = 0; i < values.end.size(); ++i) {
    json["probes"].push_back(
        {{"name", spec.probes[i].name},
         {"at_mm", array_of(spec.probes[i].at_mm)},
         {"displacement_mm", array_of(values.end[i].displacement)},
         {"contact_pressure_pa", kPaPerMegapascal * values.end[i].contact_pressure},
         {"pore_pressure_pa", kPaPerMegapascal * values.end[i].pore_pressure}});
  }
  if (!solution.history.empty()) json["time_s"] = solution.history.back().time_s;
  return json;
}

void print_solution(const ProblemSpec& spec, const forward::ForwardSolution& solution,
                    const Probed& values) {
  std::printf("%d nodes, %d tetrahedra (%s), %d unknowns, %d linear solve%s\n",
              solution.space.num_nodes(), solution.space.num_elements(),
              name_of(solution.space.element), solution.unknowns, solution.iterations,
              solution.iterations == 1 ? "" : "s");
  std::printf("largest displacement %.6g mm, residual %.1e, smallest det(I + grad u) %.4g\n",
              solution.displacement.colwise().norm().maxCoeff(), solution.relative_residual,
              solution.min_jacobian);
  for (const forward::ContactResult& c : solution.contacts) {
    std::printf("contact %s: force (%.6g, %.6g, %.6g) N, %d of %d points, pressure up to %.6g Pa\n",
                c.name.c_str(), c.force[0], c.force[1], c.force[2], c.active, c.points,
                kPaPerMegapascal * c.max_pressure);
  }
  for (std::size_t i = 0; i < values.end.size(); ++i) {
    const Vec3& u = values.end[i].displacement;
    std::printf("probe %s: u = (%.6g, %.6g, %.6g) mm", spec.probes[i].name.c_str(), u[0], u[1],
                u[2]);
    if (!solution.history.empty()) {
      std::printf(", pore pressure %.6g Pa at %.6g s",
                  kPaPerMegapascal * values.end[i].pore_pressure, solution.history.back().time_s);
    }
    std::printf("\n");
  }
}

Status run_solve(const SolveArguments& arguments) {
  if (Status ok = io::check_output_file("--out", arguments.out); !ok) return ok;
  if (!arguments.probes.empty()) {
    if (Status ok = io::check_output_file("--probes", arguments.probes); !ok) return ok;
  }
  const Progress progress = terminal_progress();
  const auto spec = io::read_problem(arguments.problem);
  if (!spec) return tl::unexpected(spec.error());
  const auto problem = load(*spec);
  if (!problem) return tl::unexpected(problem.error());
  if (Status ok = check_probes(*spec, problem->mesh); !ok) return ok;
  const auto solution = forward::solve(*problem, progress);
  if (!solution) return tl::unexpected(io::locate_in_problem(spec->file, solution.error()));
  const auto values = probe_all(*spec, *solution);
  if (!values) return tl::unexpected(values.error());
  if (Status ok = write_field(arguments.out, *solution); !ok) return ok;
  if (!arguments.probes.empty()) {
    if (Status ok = write_probes(arguments.probes, *spec, *solution, *values); !ok) return ok;
  }
  if (arguments.json) {
    std::printf("%s\n", summary(*spec, *solution, *values).dump(2).c_str());
  } else {
    print_solution(*spec, *solution, *values);
    print_wrote(arguments.out);
  }
  for (const std::string& warning : solution->warnings) {
    std::fprintf(stderr, "brainshift: warning: %s\n", warning.c_str());
  }
  return {};
}

}  // namespace

void add_solve(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<SolveArguments>();
  CLI::App* command = app.add_subcommand(
      "solve", "Solve one forward problem on any mesh, to compare with other codes.");
  add_required(*command, "--problem", arguments->problem, "problem file (YAML)");
  add_required(*command, "--out", arguments->out,
               "VTU file to write: displacement, stress, contact");
  command->add_option("--probes", arguments->probes,
                      "CSV file to write: displacement and pressures at the probes");
  command->add_flag("--json", arguments->json, "print the summary as JSON");
  command->footer(
      "The problem file names a mesh (Gmsh .msh or VTK .vtu), a material per region, conditions "
      "on\n"
      "groups of faces, contact with rigid obstacles, and probes. docs/solve.md explains every "
      "key:\n"
      "  mesh: {file: block.msh, element: p2}\n"
      "  materials: {tissue: {youngs_modulus_pa: 3000, poisson_ratio: 0.45, density_kg_m3: 1000}}\n"
      "  regions: {all: tissue}\n"
      "  body: {gravity_m_s2: [0, 0, -9.80665]}\n"
      "  conditions: {floor: {on: bottom, displacement_mm: [0, 0, 0]}}\n"
      "  probes: {top: [5, 5, 10]}\n"
      "Examples:\n"
      "  brainshift solve --problem docs/examples/solve/thick_sphere.yaml --out sphere.vtu\n"
      "  brainshift solve --problem docs/examples/solve/signorini_block.yaml --out block.vtu "
      "--probes block.csv --json");
  command->callback([arguments, &status] { status = run_solve(*arguments); });
}

}  // namespace brainshift::client
