// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/corpus.hpp"

#include <cmath>

#include "common/io/files/checksum.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "common/wire/convert.hpp"
#include "tests/benchmarks/csv_table.hpp"

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

constexpr const char* kHeading =
    "surgery,seed,sequence,source,recorded_ns,acquired_ns,coordinates,mean_mm,ordered_mm,crc32";

class Sums {
 public:
  void add(const Points& points) {
    for (Eigen::Index k = 0; k < points.size(); ++k) {
      const double c = points.data()[k];
      ++count_;
      plain_ += c;
      ordered_ += std::cos(static_cast<double>(count_)) * c;
    }
  }
  void write(ManifestEntry& entry) const {
    entry.coordinates = count_;
    if (count_ == 0) return;
    entry.mean_mm = plain_ / static_cast<double>(count_);
    entry.ordered_mm = ordered_ / static_cast<double>(count_);
  }

 private:
  std::uint64_t count_ = 0;
  double plain_ = 0.0, ordered_ = 0.0;
};

struct AddPoints {
  Sums& sums;
  void operator()(const TumourBoundary& body) const { sums.add(body.points); }
  void operator()(const CorticalSurface& body) const { sums.add(body.surface.vertices); }
  void operator()(const LandmarkPairs& body) const {
    sums.add(body.undeformed);
    sums.add(body.deformed);
  }
  void operator()(const PatientPose&) const {}
};

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

ManifestEntry entry_of(const std::string& surgery, std::uint64_t seed,
                       const client::RecordedObservation& recorded) {
  const Observation& observation = recorded.observation;
  ManifestEntry entry;
  entry.surgery = surgery;
  entry.seed = seed;
  entry.sequence = observation.sequence;
  entry.source = observation.source;
  entry.recorded_ns = recorded.recorded_ns;
  entry.acquired_ns = observation.acquired_ns;
  Sums sums;
  std::visit(AddPoints{sums}, observation.body);
  sums.write(entry);
  const std::string payload = wire::encode(observation);
  entry.crc32 = io::crc32_of(payload.data(), payload.size());
  return entry;
}

Status write_manifest(const std::filesystem::path& path,
                      const std::vector<ManifestEntry>& entries) {
  auto file = bench::CsvWriter::create(path, kHeading);
  if (!file) return tl::unexpected(file.error());
  for (const ManifestEntry& one : entries) {
    const Status ok =
        file->row({one.surgery, std::to_string(one.seed), std::to_string(one.sequence), one.source,
                   std::to_string(one.recorded_ns), std::to_string(one.acquired_ns),
                   std::to_string(one.coordinates), bench::csv_number(one.mean_mm, 12),
                   bench::csv_number(one.ordered_mm, 12), std::to_string(one.crc32)});
    if (!ok) return ok;
  }
  return {};
}

}  // namespace brainshift::replays
