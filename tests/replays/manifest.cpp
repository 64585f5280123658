// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/manifest.hpp"

#include <cmath>

#include "common/io/files/checksum.hpp"
#include "common/wire/convert.hpp"
#include "tests/benchmarks/csv_table.hpp"

namespace brainshift::replays {
namespace {

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
