// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/patient/prepare_model.hpp"

#include <future>
#include <memory>
#include <utility>

#include "common/anatomy/brain_model_builder.hpp"
#include "common/core/fnv1a.hpp"
#include "common/core/stopwatch.hpp"
#include "common/inversion/prepared/condense.hpp"
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

// Of a block that is there and was not loaded: what cannot be read as a whole, with its checksum,
// is not to be read by parts.
Status read_again(const io::CheckpointFile& file, int index, Eigen::MatrixXf rows,
                  Eigen::MatrixXd compliance) {
  if (auto status = file.read(2 * index, rows); !status) return status;
  return file.read(2 * index + 1, compliance);
}

// Blocks 2 i and 2 i + 1 of the file are the columns and the compliance of block i. The file is
// where the columns lie until they are made compact: a disk that is full ends the preparation, and
// what is finished stays for the next one.
inversion::BlockStore block_store(io::CheckpointFile& file) {
  inversion::BlockStore store;
  store.load = [&file](int index, Eigen::MatrixXf& rows, Eigen::MatrixXd& compliance) {
    return file.has(2 * index) && file.has(2 * index + 1) && file.read(2 * index, rows) &&
           file.read(2 * index + 1, compliance);
  };
  store.save = [&file](int index, const Eigen::MatrixXf& rows,
                       const Eigen::MatrixXd& compliance) -> Status {
    if (file.has(2 * index) && file.has(2 * index + 1)) {
      return read_again(file, index, rows, compliance);
    }
    if (!file.has(2 * index)) {
      if (auto status = file.append(2 * index, rows); !status) return status;
    }
    return file.has(2 * index + 1) ? Status{} : file.append(2 * index + 1, compliance);
  };
  store.read = [&file](int index, Eigen::Index first, Eigen::MatrixXf& out) {
    return file.read_columns(2 * index, first, out);
  };
  return store;
}

using FactorisedLater = std::future<Result<contact::ForwardModel>>;

// Meshes up to this size have both factors made at once, since one leaves a core idle. Both are in
// memory until one is condensed: 0.9 GiB for 18 thousand nodes, 3 GiB for 40.
constexpr int kMaxNodesForTwoFactors = 40000;

FactorisedLater factorise_beside(const std::shared_ptr<const BrainModel>& model,
                                 const CaseConfig& config, Boundary boundary) {
  if (model->mesh.num_nodes() > kMaxNodesForTwoFactors) return {};
  return std::async(std::launch::async, [model, config, boundary] {
    return contact::ForwardModel::build(*model, config, boundary);
  });
}

// which: index into kPreparedBoundaries.
Status condense_boundary(PreparedModel factorised, std::size_t which, const PrepareOptions& options,
                         PreparedPatient& prepared) {
  if (auto status = not_stopped(options); !status) return status;
  const Stopwatch watch;
  const Boundary boundary = factorised.boundary();
  const Progress progress = with_prefix(options.progress, to_string(boundary));
  prepared.timings[which] = factorised.timings();
  inversion::CondenseOptions condensing;
  condensing.progress = progress;
  condensing.stop = options.stop;
  condensing.threads = options.threads;
  if (boundary == Boundary::kContact && prepared.checkpoint) {
    condensing.store = block_store(*prepared.checkpoint);
  }
  auto condensed = inversion::condense(std::move(factorised), condensing);
  if (!condensed) return tl::unexpected(condensed.error());
  condensed->prepare_s = prepared.timings[which].total_s + watch.seconds();
  prepared.file.condensed[which] = std::move(*condensed);
  return {};
}

// The fixed boundary first: the operators of contact are the largest, and nothing else is to be in
// memory beside them.
Status prepare_boundaries(const std::shared_ptr<const BrainModel>& model, const CaseConfig& config,
                          const PrepareOptions& options, PreparedPatient& prepared) {
  static_assert(kPreparedBoundaries.size() == 2);
  prepared.file.condensed.resize(2);
  const auto [contact, fixed] = kPreparedBoundaries;
  FactorisedLater beside = factorise_beside(model, config, contact);
  auto factorised =
      PreparedModel::prepare(model, config, fixed, with_prefix(options.progress, to_string(fixed)));
  if (!factorised) return tl::unexpected(factorised.error());
  const auto prior = factorised->shared_prior();
  std::optional<contact::ForwardModel> made;
  if (beside.valid()) {
    auto forward = beside.get();
    if (!forward) return tl::unexpected(forward.error());
    made = std::move(*forward);
  }
  if (auto status = condense_boundary(std::move(*factorised), 1, options, prepared); !status) {
    return status;
  }
  if (made) {
    return condense_boundary(PreparedModel::of(model, config, std::move(*made), prior), 0, options,
                             prepared);
  }
  auto later = PreparedModel::prepare(model, config, contact,
                                      with_prefix(options.progress, to_string(contact)), prior);
  if (!later) return tl::unexpected(later.error());
  return condense_boundary(std::move(*later), 0, options, prepared);
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
  if (auto status = prepare_boundaries(model, config, options, prepared); !status) {
    auto& checkpoint = prepared.checkpoint;
    if (checkpoint && checkpoint->blocks().empty()) (void)checkpoint->remove();
    return tl::unexpected(status.error());
  }
  prepared.file.model = std::move(*model);  // nobody shares it any more
  return prepared;
}

}  // namespace brainshift::patient
