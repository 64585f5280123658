// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/replays/manifest.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>
#include <utility>

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

// Whole numbers of the table; what is none becomes a difference that is reported as unreadable.
struct Numbers {
  const bench::CsvTable& table;
  std::size_t row;
  bool whole = true;

  double real(const char* column) {
    const double value = table.number(row, column);
    whole = whole && std::isfinite(value);
    return value;
  }
  // Exact below 2^53, which 104 days of nanoseconds do not reach.
  template <typename T>
  T integer(const char* column) {
    const double value = real(column);
    whole = whole && value >= 0.0 && value <= static_cast<double>(1ULL << 53U) &&
            value == std::floor(value) &&
            value <= static_cast<double>(std::numeric_limits<T>::max());
    return whole ? static_cast<T>(value) : T{};
  }
};

bool close(double a, double b) { return std::abs(a - b) <= kSameSum_mm; }

// "" when both are the same within rounding.
std::string difference(const ManifestEntry& committed, const ManifestEntry& made) {
  if (committed.seed != made.seed)
    return fmt::format("seed {}, committed {}", made.seed, committed.seed);
  if (committed.recorded_ns != made.recorded_ns || committed.acquired_ns != made.acquired_ns) {
    return fmt::format("recorded at {} ns and acquired at {} ns, committed {} and {}",
                       made.recorded_ns, made.acquired_ns, committed.recorded_ns,
                       committed.acquired_ns);
  }
  if (committed.coordinates != made.coordinates) {
    return fmt::format("{} coordinates, committed {}", made.coordinates, committed.coordinates);
  }
  if (close(committed.mean_mm, made.mean_mm) && close(committed.ordered_mm, made.ordered_mm)) {
    return "";
  }
  return fmt::format("mean and ordered mean {:.9g} and {:.9g} mm, committed {:.9g} and {:.9g}",
                     made.mean_mm, made.ordered_mm, committed.mean_mm, committed.ordered_mm);
}

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

Result<std::vector<ManifestEntry>> read_manifest(const std::filesystem::path& path) {
  const auto table = bench::CsvTable::read(path);
  if (!table) return tl::unexpected(table.error());
  std::vector<ManifestEntry> entries;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    Numbers numbers{*table, row};
    ManifestEntry entry;
    entry.surgery = table->text(row, "surgery");
    entry.source = table->text(row, "source");
    entry.seed = numbers.integer<std::uint64_t>("seed");
    entry.sequence = numbers.integer<std::uint64_t>("sequence");
    entry.recorded_ns = numbers.integer<std::int64_t>("recorded_ns");
    entry.acquired_ns = numbers.integer<std::int64_t>("acquired_ns");
    entry.coordinates = numbers.integer<std::uint64_t>("coordinates");
    entry.mean_mm = numbers.real("mean_mm");
    entry.ordered_mm = numbers.real("ordered_mm");
    entry.crc32 = numbers.integer<std::uint32_t>("crc32");
    if (!numbers.whole) {
      return fail(ErrorCode::kUnreadable,
                  fmt::format("{}: line {}: a column is missing, or its cell is no such number",
                              path.string(), row + 2));
    }
    entries.push_back(std::move(entry));
  }
  return entries;
}

ManifestComparison compare_manifests(const std::vector<ManifestEntry>& committed,
                                     const std::vector<ManifestEntry>& made) {
  using Key = std::pair<std::string, std::uint64_t>;
  std::map<Key, const ManifestEntry*> expected;
  for (const ManifestEntry& one : committed) expected[{one.surgery, one.sequence}] = &one;
  ManifestComparison comparison;
  const auto differs = [&](const Key& key, const std::string& how) {
    comparison.differences.push_back(
        fmt::format("{}, observation {}: {}", key.first, key.second, how));
  };
  for (const ManifestEntry& one : made) {
    const Key key{one.surgery, one.sequence};
    const auto found = expected.find(key);
    if (found == expected.end()) {
      differs(key, "is not in the committed table");
      continue;
    }
    const std::string how = one.source == found->second->source
                                ? difference(*found->second, one)
                                : "of " + one.source + ", committed of " + found->second->source;
    if (!how.empty()) {
      differs(key, how);
    } else if (one.crc32 == found->second->crc32) {
      ++comparison.same_bits;
    } else {
      ++comparison.same_within_rounding;
    }
    expected.erase(found);
  }
  for (const auto& [key, unused] : expected) differs(key, "is missing");
  return comparison;
}

}  // namespace brainshift::replays
