// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/patient/read_patient.hpp"

#include <utility>

#include "common/anatomy/brain_model_builder.hpp"
#include "common/io/config/config_file.hpp"

namespace brainshift::patient {

Result<BrainModel> build_patient(const CaseConfig& config, const Progress& progress) {
  const auto inputs = io::load_case_inputs(config);
  if (!inputs) return tl::unexpected(inputs.error());
  return anatomy::build_brain_model(*inputs, progress);
}

Result<Patient> read_patient(const std::filesystem::path& case_file, const Progress& progress) {
  auto config = io::read_case_config(case_file);
  if (!config) return tl::unexpected(config.error());
  auto model = build_patient(*config, progress);
  if (!model) return tl::unexpected(model.error());
  return Patient{std::move(*config), std::move(*model)};
}

}  // namespace brainshift::patient
