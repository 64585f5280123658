// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/toy_journal.hpp"

#include <cmath>
#include <stdexcept>

#include "common/io/config/config_file.hpp"
#include "common/io/model/model_file.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/values/model_id.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::test_support {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

void require(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message);
}

io::SurgeryRecord toy_observation() {
  Observation made;
  made.case_id = "toy";
  made.source = "ius";
  made.sequence = 1;
  made.body = LandmarkPairs{Points::Ones(3, 4), Points::Ones(3, 4), 0.3};
  return {io::RecordKind::kObservation, 1, kSecond_ns, wire::encode(made)};
}

}  // namespace

BrainModel toy_model(int cells) {
  BrainModel model = toy_patient(cells);
  model.case_id = "toy";
  model.model_id = content_hash(model);
  return model;
}

Points toy_displacement(const Points& x, double scale) {
  Points u(3, x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    u.col(i) = scale * Vec3(1.5 * std::sin(0.03 * x(0, i)), 2.0 * std::cos(0.025 * x(1, i)),
                            -3.0 - 1.5 * std::cos(0.025 * x(2, i) + 0.02 * x(0, i)));
  }
  return u;
}

UpdateMessage toy_update(const BrainModel& model, std::uint64_t sequence, Quality quality,
                         double scale) {
  UpdateMessage made;
  made.session_id = 41;
  Update& update = made.update;
  update.case_id = model.case_id;
  update.model_id = model.model_id;
  update.sequence = sequence;
  update.observation_sequence = 100 + sequence;
  Estimate& estimate = update.estimate;
  estimate.status = EstimateStatus::kConverged;
  estimate.displacement = toy_displacement(model.mesh.nodes, scale);
  estimate.sd_mm = VecX::Constant(model.mesh.num_nodes(), 0.25);
  estimate.known = VecX::Constant(model.mesh.num_nodes(), 0.6);
  estimate.quality.quality = quality;
  if (quality == Quality::kCaution) estimate.quality.flags.set(QualityFlag::kDeadline);
  if (quality == Quality::kUnusable) estimate.quality.flags.set(QualityFlag::kVolumeLost);
  if (!estimate.quality.flags.empty()) estimate.quality.reason = "as the test wants it";
  return made;
}

void write_toy_journal(const std::filesystem::path& path, const BrainModel& model,
                       const std::vector<UpdateMessage>& updates) {
  auto file = io::SurgeryFile::create(path, {.case_id = "toy", .model_id = model.model_id});
  if (!file) throw std::runtime_error(file.error().message);
  require(file->append(toy_observation()));
  for (const UpdateMessage& one : updates) {
    require(file->append(
        {io::RecordKind::kUpdate, one.update.sequence, 2 * kSecond_ns, wire::encode(one)}));
  }
  require(file->close());
}

void write_toy_model(const std::filesystem::path& path, const BrainModel& model) {
  const auto config = io::parse_case_config(R"(case_id: toy
images: {brain: mask.nii}
tumour: {ellipsoid: {centre_mm: [30, 30, 40], semi_axes_mm: [10, 10, 10]}}
craniotomy: {centre_mm: [30, 30, 60]}
brainstem: {centre_mm: [30, 30, 0]}
gravity: {direction: [0, 0, -1]}
)",
                                            path.parent_path() / "toy.yaml");
  if (!config) throw std::runtime_error(config.error().message);
  io::ModelFile file;
  file.config = *config;
  file.model = model;
  require(io::write_model(path, file));
}

}  // namespace brainshift::test_support
