// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/import/import_case.hpp"

#include <fmt/format.h>

#include <utility>

#include "common/core/utc_time.hpp"
#include "common/io/model/model_file.hpp"
#include "common/patient/read_patient.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

ImportCase of(BrainModel model, const fs::path& case_file) {
  return {std::move(model), fs::absolute(case_file).lexically_normal()};
}

}  // namespace

Vec3 ImportCase::tumour_centroid() const { return model.tumour.vertices.rowwise().mean(); }

io::SurgeryMeta ImportCase::meta(const std::string& scenario, const std::string& software) const {
  io::SurgeryMeta meta;
  meta.case_id = model.case_id;
  meta.model_id = model.model_id;
  meta.case_file = case_file.string();
  meta.scenario = scenario;
  meta.created_utc = utc_now();
  meta.software = software;
  return meta;
}

Status check_one_case(const fs::path& case_file, const fs::path& model) {
  if (case_file.empty() != model.empty()) return {};
  return fail(ErrorCode::kInvalidArgument,
              fmt::format("exactly one of --case and --model is required, {} given",
                          model.empty() ? "none" : "both"));
}

Result<ImportCase> load_import_case(const fs::path& case_file, const fs::path& model,
                                    const Progress& progress) {
  if (!model.empty()) {
    auto file = io::read_model(model, {});
    if (!file) return tl::unexpected(file.error());
    return of(std::move(file->model), file->config.file);
  }
  auto patient = patient::read_patient(case_file, progress);
  if (!patient) return tl::unexpected(patient.error());
  return of(std::move(patient->model), case_file);
}

}  // namespace brainshift::client
