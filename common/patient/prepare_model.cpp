// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/patient/prepare_model.hpp"

#include <memory>
#include <string>
#include <utility>

#include "common/anatomy/brain_model_builder.hpp"
#include "common/core/fnv1a.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/prepared/condense.hpp"
#include "common/inversion/prepared/full_solve.hpp"
#include "common/io/config/case_inputs_file.hpp"
#include "common/io/config/config_file.hpp"

namespace brainshift::patient {
namespace {

using inversion::PreparedModel;

// "contact: factor" and so on.
Progress with_prefix(const Progress& progress, std::string_view prefix) {
  return [&progress, prefix = std::string(prefix) + ": "](std::string_view stage, double fraction) {
    report(progress, prefix + std::string(stage), fraction);
  };
}

Status not_stopped(const PrepareOptions& options) {
  if (!options.stop.stop_requested()) return {};
  return fail(ErrorCode::kUnavailable, "preparation was stopped");
}

// Opens the checkpoint that belongs to this model and case: the contact columns depend on both.
Status open_checkpoint(const PrepareOptions& options, const CaseConfig& config,
                       const BrainModel& model, PreparedPatient& prepared) {
  if (options.checkpoint.empty()) return {};
  auto file = io::CheckpointFile::open_or_create(
      options.checkpoint, fnv1a(model.model_id + io::case_config_text(config)));
  if (!file) return tl::unexpected(file.error());
  if (options.on_resume && !file->blocks().empty()) options.on_resume();
  prepared.checkpoint = std::move(*file);
  return {};
}

// Blocks 2 i and 2 i + 1 of the file are the columns and the compliance of block i. A block that
// cannot be kept is solved again next time; the preparation goes on.
inversion::BlockStore block_store(io::CheckpointFile& file) {
  inversion::BlockStore store;
  store.load = [&file](int index, Eigen::MatrixXf& columns, Eigen::MatrixXd& compliance) {
    return file.has(2 * index) && file.has(2 * index + 1) && file.read(2 * index, columns) &&
           file.read(2 * index + 1, compliance);
  };
  store.save = [&file](int index, const Eigen::MatrixXf& columns,
                       const Eigen::MatrixXd& compliance) {
    if (!file.has(2 * index)) (void)file.append(2 * index, columns);
    if (!file.has(2 * index + 1)) (void)file.append(2 * index + 1, compliance);
  };
  return store;
}

// Factorises and condenses. prior: nullptr before the first boundary.
Status prepare_boundary(const std::shared_ptr<const BrainModel>& model, const CaseConfig& config,
                        std::size_t which, const PrepareOptions& options,
                        std::shared_ptr<const prior::ForcePrior>& prior,
                        PreparedPatient& prepared) {
  if (auto status = not_stopped(options); !status) return status;
  const Stopwatch watch;
  const Boundary boundary = kPreparedBoundaries[which];
  const Progress progress = with_prefix(options.progress, to_string(boundary));
  const auto factorised = PreparedModel::prepare(model, config, boundary, progress, prior);
  if (!factorised) return tl::unexpected(factorised.error());
  prior = factorised->shared_prior();
  if (auto status = not_stopped(options); !status) return status;
  report(progress, "measure", 0.0);
  prepared.boundaries[which] = {factorised->timings(),
                                inversion::measure_full_solve_ms(factorised->forward())};
  inversion::CondenseOptions condensing;
  condensing.progress = progress;
  condensing.stop = options.stop;
  condensing.threads = options.threads;
  if (boundary == Boundary::kContact && prepared.checkpoint) {
    condensing.store = block_store(*prepared.checkpoint);
  }
  auto condensed = inversion::condense(*factorised, condensing);
  if (!condensed) return tl::unexpected(condensed.error());
  condensed->prepare_s = watch.seconds();
  prepared.file.condensed.push_back(std::move(*condensed));
  return {};
}

}  // namespace

Result<PreparedPatient> prepare_model(const CaseConfig& config, const PrepareOptions& options) {
  PreparedPatient prepared;
  prepared.file.config = config;
  const Stopwatch reading;
  report(options.progress, "read images", 0.0);
  auto recorded = io::record_inputs(config);
  if (!recorded) return tl::unexpected(recorded.error());
  prepared.file.inputs = std::move(*recorded);
  const auto inputs = io::load_case_inputs(config);
  if (!inputs) return tl::unexpected(inputs.error());
  prepared.read_s = reading.seconds();

  if (auto status = not_stopped(options); !status) return tl::unexpected(status.error());
  const Stopwatch meshing;
  auto built = anatomy::build_brain_model(*inputs, options.progress, &prepared.notes);
  if (!built) return tl::unexpected(built.error());
  const auto model = std::make_shared<BrainModel>(std::move(*built));
  prepared.mesh_s = meshing.seconds();

  if (auto status = open_checkpoint(options, config, *model, prepared); !status) {
    return tl::unexpected(status.error());
  }
  std::shared_ptr<const prior::ForcePrior> prior;
  for (std::size_t i = 0; i < kPreparedBoundaries.size(); ++i) {
    const auto status = prepare_boundary(model, config, i, options, prior, prepared);
    if (status) continue;
    auto& checkpoint = prepared.checkpoint;
    if (checkpoint && checkpoint->blocks().empty()) (void)checkpoint->remove();
    return tl::unexpected(status.error());
  }
  prepared.file.model = std::move(*model);  // nobody shares it any more
  return prepared;
}

}  // namespace brainshift::patient
