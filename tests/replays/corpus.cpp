// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/corpus.hpp"

#include <cmath>

#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"

namespace brainshift::replays {
namespace {

std::vector<double> falling(double first_mm, double last_mm, int moments) {
  std::vector<double> levels;
  for (int i = 0; i < moments; ++i) {
    levels.push_back(first_mm + (last_mm - first_mm) * i / (moments - 1));
  }
  return levels;
}

CorpusSurgery surgery(const char* scenario, std::uint64_t seed, std::vector<double> levels_mm) {
  CorpusSurgery one{scenario, *client::find_scenario(scenario), seed};
  if (!levels_mm.empty()) one.scenario.fluid_levels_mm = std::move(levels_mm);
  return one;
}

std::int64_t nanoseconds(double seconds) { return std::llround(1e9 * seconds); }

}  // namespace

const std::vector<CorpusSurgery>& corpus() {
  static const std::vector<CorpusSurgery> surgeries = {
      surgery("sag-progress", 1, {}),  // 20 moments of its own, one instrument
      surgery("joint-mixed", 2, falling(10.0, 35.0, 6)),
      surgery("joint-tangential", 3, falling(30.0, 55.0, 6)),
      surgery("resection", 4, falling(35.0, 55.0, 5)),
      surgery("joint-distension", 5, falling(0.0, 25.0, 6))};
  return surgeries;
}

std::vector<client::RecordedObservation> record(const client::SimulatedSurgery& surgery,
                                                std::size_t moments) {
  const std::size_t instruments = surgery.observations.size() / moments;
  const double moment_s = kPerObservation_s * static_cast<double>(instruments);
  std::vector<client::RecordedObservation> recording;
  for (std::size_t i = 0; i < surgery.observations.size(); ++i) {
    const double at_s = moment_s * static_cast<double>(i / instruments) +
                        kBetween_s * static_cast<double>(i % instruments);
    recording.push_back({nanoseconds(at_s), surgery.observations[i]});
  }
  return recording;
}

Status write_recording(const std::filesystem::path& path, const io::SurgeryMeta& meta,
                       const std::vector<client::RecordedObservation>& recording) {
  auto file = io::SurgeryFile::create(path, meta);
  if (!file) return tl::unexpected(file.error());
  std::vector<io::SurgeryRecord> records;
  for (const auto& [recorded_ns, observation] : recording) {
    records.push_back({io::RecordKind::kObservation, observation.sequence, recorded_ns,
                       wire::encode(observation)});
  }
  Status status = file->append(records);
  if (status) status = file->close();
  if (!status) io::discard_surgery(path);
  return status;
}

Result<Recording> read_recording(const std::filesystem::path& path) {
  const auto file = io::SurgeryFile::open(path);
  if (!file) return tl::unexpected(file.error());
  const auto records = file->records(io::RecordKind::kObservation);
  if (!records) return tl::unexpected(records.error());
  Recording recording{file->meta(), {}};
  for (const io::SurgeryRecord& record : *records) {
    auto observation = wire::decode_observation(record.payload);
    if (!observation) {
      return fail(ErrorCode::kUnreadable, path.string() + ": observation " +
                                              std::to_string(record.sequence) + ": " +
                                              observation.error().message);
    }
    recording.observations.push_back(
        {record.recorded_ns, client::for_replay(std::move(*observation))});
  }
  if (recording.observations.empty()) {
    return fail(ErrorCode::kEmptySet, path.string() + ": holds no observation");
  }
  return recording;
}

}  // namespace brainshift::replays
