// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/head.hpp"

#include <algorithm>
#include <cctype>
#include <tuple>

#include "common/geometry/surface.hpp"
#include "common/io/geometry/label_map_file.hpp"
#include "common/io/geometry/mesh_file.hpp"
#include "common/patient/read_patient.hpp"

namespace brainshift::client {
namespace {

bool same_run_but_boundary(const RunReport& a, const RunReport& b) {
  return a.case_id == b.case_id && a.scenario == b.scenario && a.method == b.method &&
         a.seed == b.seed && a.model_id == b.model_id;
}

Vec3 mean_of(const Points& points) {
  return points.cols() == 0 ? Vec3(Vec3::Zero()) : Vec3(points.rowwise().mean());
}

}  // namespace

Result<Head> load_head(const std::filesystem::path& case_file, const Progress& progress) {
  auto patient = patient::read_patient(case_file, progress);
  if (!patient) return tl::unexpected(patient.error());
  BrainModel& model = patient->model;

  Head head;
  if (!patient->config.mri.empty()) {
    auto mri = io::read_volume(patient->config.mri);
    if (!mri) return tl::unexpected(mri.error());
    head.mri = std::move(*mri);
  }
  head.craniotomy_centre = mean_of(model.mesh.nodes(Eigen::all, model.craniotomy));
  head.model_id = model.model_id;
  head.tumour = std::move(model.tumour);
  head.septa = geometry::surface_of(model.mesh.nodes, model.septa.triangles);
  head.ventricles = geometry::surface_of(model.mesh.nodes, model.ventricle_wall);
  head.tumour_centre = mean_of(head.tumour.vertices);
  head.gravity_direction = model.gravity_direction;
  return head;
}

Result<RunField> load_field(const std::filesystem::path& path) {
  auto file = io::read_vtu(path);
  if (!file) return tl::unexpected(file.error());
  const auto find = [&](const char* name) -> const Eigen::MatrixXd* {
    for (const io::NodeField& field : file->node_fields) {
      if (field.name == name) return &field.values;
    }
    return nullptr;
  };
  const auto fits = [&](const Eigen::MatrixXd& values, int rows) {
    return values.rows() == rows && values.cols() == file->mesh.num_nodes() && values.allFinite();
  };
  const Eigen::MatrixXd* estimated = find("displacement_estimated");
  const Eigen::MatrixXd* truth = find("displacement_true");
  const Eigen::MatrixXd* known = find("known");
  const Eigen::MatrixXd* sd = find("sd_mm");
  const std::tuple<const Eigen::MatrixXd*, const char*, int> arrays[] = {
      {estimated, "displacement_estimated", 3},
      {truth, "displacement_true", 3},
      {known, "known", 1},
      {sd, "sd_mm", 1}};
  for (const auto& [values, name, rows] : arrays) {
    const bool required = values == estimated;
    if ((values == nullptr && required) || (values != nullptr && !fits(*values, rows))) {
      return fail(ErrorCode::kUnreadable, path.string() + ": point array " + name + " must hold " +
                                              std::to_string(rows) +
                                              " finite number(s) for each of the " +
                                              std::to_string(file->mesh.num_nodes()) + " nodes");
    }
  }
  RunField field;
  field.estimated = *estimated;
  if (truth != nullptr) field.truth = Points(*truth);
  if (known != nullptr) field.known = known->transpose();
  if (sd != nullptr) field.sd_mm = sd->transpose();
  field.mesh = std::move(file->mesh);
  return field;
}

std::string file_name_from(const std::string& text) {
  std::string name = text;
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_') c = '-';
  }
  return name;
}

std::vector<RunGroup> group_runs(const std::vector<ReportedRun>& runs) {
  std::vector<RunGroup> groups;
  const auto slot_of = [](RunGroup& group, const RunReport& run) -> std::optional<std::size_t>& {
    return run.boundary == to_string(Boundary::kFixed) ? group.fixed : group.contact;
  };
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const RunReport& run = runs[i].report;
    const auto open = std::find_if(groups.begin(), groups.end(), [&](RunGroup& group) {
      return !slot_of(group, run) && same_run_but_boundary(runs[group.any()].report, run);
    });
    if (open != groups.end()) {
      slot_of(*open, run) = i;
      continue;
    }
    const bool several_methods = std::any_of(runs.begin(), runs.end(), [&](const ReportedRun& r) {
      return r.report.scenario == run.scenario && r.report.method != run.method;
    });
    const std::string base =
        file_name_from(several_methods ? run.scenario + "-" + run.method : run.scenario);
    std::string name = base;
    const auto taken = [&] {
      return std::any_of(groups.begin(), groups.end(),
                         [&](const RunGroup& g) { return g.name == name; });
    };
    for (int n = 2; taken(); ++n) name = base + "-" + std::to_string(n);
    RunGroup group{name, std::nullopt, std::nullopt};
    slot_of(group, run) = i;
    groups.push_back(std::move(group));
  }
  return groups;
}

}  // namespace brainshift::client
