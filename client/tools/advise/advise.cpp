// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/advise/advise.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <utility>

#include "common/geometry/misplacement.hpp"
#include "common/io/files/file_access.hpp"
#include "common/io/model/model_file.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/pipeline/pipeline.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::client {
namespace {

Result<io::SurgeryFile> open_of(const std::filesystem::path& surgery, const std::string& model_id) {
  auto file = io::SurgeryFile::open(surgery);
  if (file && file->meta().model_id != model_id) {
    return io::invalid_file(surgery, fmt::format("meta.model_id is \"{}\", the model is \"{}\"",
                                                 file->meta().model_id, model_id));
  }
  return file;
}

Result<Observation> decode(const std::filesystem::path& surgery, const io::SurgeryRecord& record) {
  auto observation = wire::decode_observation(record.payload);
  if (observation) return observation;
  return io::unreadable(
      surgery, fmt::format("observation {}: {}", record.sequence, observation.error().message));
}

Result<std::vector<Observation>> first_of(const std::filesystem::path& surgery,
                                          const std::string& model_id, std::uint64_t count) {
  const auto file = open_of(surgery, model_id);
  if (!file) return tl::unexpected(file.error());
  const auto records = file->records(io::RecordKind::kObservation);
  if (!records) return tl::unexpected(records.error());
  if (records->empty()) {
    return io::file_error(ErrorCode::kEmptySet, surgery, "holds no observation");
  }
  if (count > records->size()) {
    return invalid(fmt::format("--observations is {}, but {} holds {}", count, surgery.string(),
                               records->size()));
  }
  if (count == 0) count = records->size();
  std::vector<Observation> observations;
  for (const io::SurgeryRecord& record : std::span(*records).first(count)) {
    auto observation = decode(surgery, record);
    if (!observation) return tl::unexpected(observation.error());
    observations.push_back(std::move(*observation));
  }
  return observations;
}

// In the order in which they came.
Result<std::vector<Observation>> used_of(const std::filesystem::path& journal,
                                         const std::string& model_id, const SessionKey& session,
                                         std::map<std::string, std::uint64_t> used) {
  const auto file = open_of(journal, model_id);
  if (!file) return tl::unexpected(file.error());
  std::vector<Observation> observations;
  const Status read = file->newest_first(
      io::RecordKind::kObservation, [&](const io::SurgeryRecord& record) -> Result<bool> {
        auto observation = decode(journal, record);
        if (!observation) return tl::unexpected(observation.error());
        const SessionKey& of = observation->session;
        if (of.boot_id != session.boot_id || of.session_id != session.session_id) {
          return fail(ErrorCode::kUnavailable, journal.string() + " is of another session");
        }
        const auto one = used.find(observation->source);
        if (one != used.end() && one->second == observation->sequence) {
          used.erase(one);
          observations.push_back(std::move(*observation));
        }
        return !used.empty();
      });
  if (!read) return tl::unexpected(read.error());
  if (!used.empty()) {
    return fail(ErrorCode::kUnavailable,
                fmt::format("{} does not hold observation {} of {}", journal.string(),
                            used.begin()->second, used.begin()->first));
  }
  std::reverse(observations.begin(), observations.end());
  return observations;
}

Result<pipeline::Pipeline> build_pipeline(const AdviserOptions& options, io::ModelFile& file,
                                          std::shared_ptr<const geometry::TetLocator> locator) {
  if (file.condensed.empty()) {
    return io::file_error(ErrorCode::kEmptySet, options.model,
                          fmt::format("holds no operators for the boundary condition {}",
                                      to_string(options.boundary)));
  }
  auto inverter = inversion::condensed_inverter(
      std::make_shared<const CondensedOperators>(std::move(file.condensed.front())),
      std::move(locator), file.config);
  if (!inverter) return tl::unexpected(inverter.error());
  return pipeline::Pipeline::build(file.model, file.config, Method::kCondensed, options.boundary,
                                   std::move(*inverter));
}

Status play(const std::vector<Observation>& observations, pipeline::Pipeline& pipeline,
            const Progress& progress, std::stop_token stop, Advised& advised) {
  pipeline.reset();
  std::set<std::string> sources;
  bool answered = false;
  for (const Observation& observation : observations) {
    auto update = pipeline.run(observation, {.on_iterate = {}, .stop = stop});
    ++advised.played;
    if (progress) {
      progress("play",
               static_cast<double>(advised.played) / static_cast<double>(observations.size()));
    }
    answered = update.has_value();
    if (!update) {
      advised.failures.push_back(fmt::format("observation {} of {}: {}", observation.sequence,
                                             observation.source, update.error().message));
      continue;
    }
    sources.insert(observation.source);
    advised.update = std::move(*update);
  }
  advised.sources.assign(sources.begin(), sources.end());
  if (!answered) {
    return fail(ErrorCode::kNotConverged,
                "advise: the last observation gave no estimate: " + advised.failures.back());
  }
  const QualityVerdict& verdict = advised.update.estimate.quality;
  if (verdict.usable()) return {};
  return fail(ErrorCode::kNotConverged,
              "advise: the field after the last observation is unusable: " + verdict.reason);
}

nlohmann::json place_json(const Vec3& place) { return {place[0], place[1], place[2]}; }

}  // namespace

struct Adviser::Impl {
  std::shared_ptr<const BrainModel> model;
  CaseConfig config;
  std::shared_ptr<const geometry::TetLocator> locator;
  pipeline::Pipeline pipeline;
  std::vector<advice::Candidate> candidates;
  advice::Target target;

  Result<Advised> advise(const Result<std::vector<Observation>>& observations,
                         const Progress& progress, std::stop_token stop) {
    if (!observations) return tl::unexpected(observations.error());
    Advised advised;
    advised.model = model;
    advised.target = target;
    if (Status ok = play(*observations, pipeline, progress, std::move(stop), advised); !ok) {
      return tl::unexpected(ok.error());
    }
    auto ranked =
        advice::rank(pipeline, config, *locator, advised.update.estimate, candidates, target);
    if (!ranked) return tl::unexpected(ranked.error());
    advised.advice = std::move(*ranked);
    return advised;
  }
};

Adviser::Adviser(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Adviser::Adviser(Adviser&&) noexcept = default;
Adviser& Adviser::operator=(Adviser&&) noexcept = default;
Adviser::~Adviser() = default;

Result<Adviser> Adviser::open(const AdviserOptions& options) {
  auto file = io::read_model(options.model, {options.boundary});
  if (!file) return tl::unexpected(file.error());
  auto candidates =
      options.candidates.empty()
          ? Result<std::vector<advice::Candidate>>(advice::default_candidates(file->model))
          : advice::read_candidates(options.candidates, file->model);
  if (!candidates) return tl::unexpected(candidates.error());
  auto locator = std::make_shared<const geometry::TetLocator>(file->model.mesh);
  auto pipeline = build_pipeline(options, *file, locator);
  if (!pipeline) return tl::unexpected(pipeline.error());
  advice::Target target;
  if (options.target_mm) {
    const Vec3& at = *options.target_mm;
    const std::string metres = geometry::metres_for_millimetres(
        at, [&](const Vec3& x) { return locator->locate(x).distance_mm == 0.0; });
    if (!metres.empty()) {
      return invalid(fmt::format("--target {:g} {:g} {:g} {}", at[0], at[1], at[2], metres));
    }
    target = {fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", at[0], at[1], at[2]), at};
  } else {
    target = advice::tumour_target(file->model);
  }
  return Adviser(std::unique_ptr<Impl>(new Impl{
      std::make_shared<const BrainModel>(std::move(file->model)), file->config, std::move(locator),
      std::move(*pipeline), std::move(*candidates), std::move(target)}));
}

const std::string& Adviser::model_id() const { return impl_->model->model_id; }

Result<Advised> Adviser::after(const std::filesystem::path& surgery, std::uint64_t count,
                               const Progress& progress) {
  return impl_->advise(first_of(surgery, model_id(), count), progress, {});
}

Result<Advised> Adviser::now(const std::filesystem::path& journal, const SessionKey& session,
                             const std::map<std::string, std::uint64_t>& used,
                             std::stop_token stop) {
  return impl_->advise(used_of(journal, model_id(), session, used), {}, std::move(stop));
}

std::vector<std::string> advise_lines(const Advised& advised) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("{}: sd {:.3f} mm per component, after {} observation{} of {} ({})",
                              advised.target.name, advised.advice.front().before_mm, advised.played,
                              advised.played == 1 ? "" : "s", fmt::join(advised.sources, ", "),
                              to_string(advised.update.estimate.quality.quality)));
  lines.push_back(fmt::format("{:>4} {:>8} {:>8}  {:<42} {}", "rank", "sd mm", "less mm",
                              "measurement", "at R, A, S mm"));
  int rank = 0;
  for (const advice::Advice& one : advised.advice) {
    const Vec3 at = one.candidate.centre();
    if (!one.reason.empty()) {
      lines.push_back(
          fmt::format("{:>4} {:>8} {:>8}  {:<42} {}", "-", "", "", one.candidate.name, one.reason));
      continue;
    }
    lines.push_back(fmt::format("{:>4} {:>8.3f} {:>8.3f}  {:<42} {:.0f}, {:.0f}, {:.0f}", ++rank,
                                one.after_mm, one.reduction_mm(), one.candidate.name, at[0], at[1],
                                at[2]));
  }
  for (const std::string& failure : advised.failures) lines.push_back("left out: " + failure);
  return lines;
}

std::string advise_json(const Advised& advised) {
  nlohmann::json candidates = nlohmann::json::array();
  for (std::size_t i = 0; i < advised.advice.size(); ++i) {
    const advice::Advice& one = advised.advice[i];
    const auto number = [&](double value) {
      return one.reason.empty() ? nlohmann::json(value) : nlohmann::json();
    };
    nlohmann::json entry = {{"rank", i + 1},
                            {"name", one.candidate.name},
                            {"kind", std::string(to_string(one.candidate.kind))},
                            {"sd_before_mm", number(one.before_mm)},
                            {"sd_after_mm", number(one.after_mm)},
                            {"reduction_mm", number(one.reduction_mm())},
                            {"where_mm", place_json(one.candidate.centre())},
                            {"data", one.data}};
    if (!one.reason.empty()) entry["reason"] = one.reason;
    candidates.push_back(std::move(entry));
  }
  const nlohmann::json json = {
      {"case", advised.model->case_id},
      {"model_id", advised.model->model_id},
      {"observations", advised.played},
      {"sources", advised.sources},
      {"quality", std::string(to_string(advised.update.estimate.quality.quality))},
      {"target",
       {{"name", advised.target.name},
        {"centre_mm", place_json(advised.target.points.rowwise().mean())}}},
      {"failures", advised.failures},
      {"candidates", std::move(candidates)}};
  return json.dump(2) + "\n";
}

}  // namespace brainshift::client
