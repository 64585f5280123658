// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/patient/prepare_model.hpp"

#include <fmt/format.h>

#include <algorithm>
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

// The status of a step that every process makes for itself, as all of them see it.
template <typename T>
Status agreed(const PrepareOptions& options, const tl::expected<T, Error>& own) {
  const Status status = own ? Status{} : Status(tl::unexpected(own.error()));
  return options.ranks != nullptr ? options.ranks->agree(status) : status;
}

// Each process meshes for itself: what another processor made of it must be the same to the bit.
Status same_model(const PrepareOptions& options, const BrainModel& model) {
  if (options.ranks == nullptr) return {};
  const auto* id = reinterpret_cast<const std::byte*>(model.model_id.data());
  const Ranks::Bytes own(id, id + model.model_id.size());
  const auto ids = options.ranks->exchange(
      std::vector<Ranks::Bytes>(static_cast<std::size_t>(options.ranks->size()), own));
  const auto differs =
      std::find_if(ids.begin(), ids.end(), [&](const auto& other) { return other != ids.front(); });
  if (differs == ids.end()) return {};
  return fail(ErrorCode::kInternal,
              fmt::format("process {} made another mesh than the first one; mesh.file gives all "
                          "the same",
                          differs - ids.begin()));
}

// Opens the checkpoint that belongs to this model and case: the contact columns depend on both.
Status open_checkpoint(const PrepareOptions& options, const CaseConfig& config,
                       const BrainModel& model, PreparedPatient& prepared) {
  if (options.checkpoint.empty()) return {};
  std::filesystem::path path = options.checkpoint;
  if (options.ranks != nullptr) path += fmt::format(".{}", options.ranks->rank());
  const std::uint64_t key = fnv1a(model.model_id + io::case_config_text(config));
  auto file = io::CheckpointFile::open_or_create(path, key);
  if (file && options.ranks != nullptr && !file->blocks().empty()) {
    if (auto ok = file->remove(); !ok) return ok;
    file = io::CheckpointFile::open_or_create(path, key);
  }
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
    if (compliance.size() == 0) return {};
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
                                 const CaseConfig& config, Boundary boundary,
                                 const PrepareOptions& options) {
  const bool one_thread = options.threads == 1 || options.ranks != nullptr;
  if (model->mesh.num_nodes() > kMaxNodesForTwoFactors || one_thread) return {};
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
  FactorisedLater beside = factorise_beside(model, config, contact, options);
  auto factorised =
      PreparedModel::prepare(model, config, fixed, with_prefix(options.progress, to_string(fixed)),
                             nullptr, options.ranks);
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
                                      with_prefix(options.progress, to_string(contact)), prior,
                                      options.ranks);
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
  if (auto ok = agreed(options, recorded); !ok) return tl::unexpected(ok.error());
  prepared.file.inputs = std::move(*recorded);
  const auto inputs = io::load_case_inputs(config);
  if (auto ok = agreed(options, inputs); !ok) return tl::unexpected(ok.error());
  prepared.read_s = reading.seconds();

  if (auto status = not_stopped(options); !status) return tl::unexpected(status.error());
  const Stopwatch meshing;
  auto built = anatomy::build_brain_model(*inputs, options.progress, &prepared.notes);
  if (auto ok = agreed(options, built); !ok) return tl::unexpected(ok.error());
  if (auto ok = same_model(options, *built); !ok) return tl::unexpected(ok.error());
  const auto model = std::make_shared<BrainModel>(std::move(*built));
  prepared.mesh_s = meshing.seconds();

  if (auto status = agreed(options, open_checkpoint(options, config, *model, prepared)); !status) {
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
