// SPDX-License-Identifier: Apache-2.0
#include "common/configuration/case_keys.hpp"

#include <algorithm>
#include <optional>
#include <type_traits>
#include <utility>

namespace brainshift {
namespace {

struct Place {
  std::string key;
  const std::filesystem::path* path;
};

// Every path of a case, with its key.
class PathCollector : public KeyWalker<PathCollector> {
 public:
  template <typename T, typename... More>
  void operator()(const Key& key, const T& value, const More&...) {
    if constexpr (std::is_same_v<T, std::filesystem::path>) {
      places.push_back({full(key), &value});
    } else if constexpr (std::is_same_v<T, std::optional<std::filesystem::path>>) {
      if (value) places.push_back({full(key), &*value});
    }
  }
  std::vector<Place> places;
};

std::vector<Place> places_of(const CaseConfig& config) {
  PathCollector collector;
  visit(collector, config);
  return std::move(collector.places);
}

}  // namespace

std::vector<NamedFile> named_files(const CaseConfig& config) {
  const bool meshed = std::holds_alternative<MeshGeneration>(config.mesh);
  std::vector<NamedFile> files;
  for (const Place& place : places_of(config)) {
    const bool read = meshed || place.path != &config.brain;
    if (read && !place.path->empty()) files.push_back({place.key, *place.path});
  }
  return files;
}

std::string key_of(const CaseConfig& config, const std::filesystem::path& member) {
  for (const Place& place : places_of(config)) {
    if (place.path == &member) return place.key;
  }
  return {};
}

// What case_config.hpp declares.

double largest_poisson_ratio(const Material& material) {
  double largest = material.poisson_ratio;
  if (material.tumour) largest = std::max(largest, material.tumour->poisson_ratio);
  for (const auto& [label, tissue] : material.regions) {
    largest = std::max(largest, tissue.poisson_ratio);
  }
  return largest;
}

Status validate(const CaseConfig& config) {
  KeyChecker checker;
  visit(checker, config);
  checker.require(!config.brain.empty() || !std::holds_alternative<MeshGeneration>(config.mesh),
                  "images.brain", "must name a brain mask to mesh");
  checker.require(!config.anatomy.labels || std::holds_alternative<MeshGeneration>(config.mesh),
                  "anatomy.labels", "needs a mesh that is generated (mesh.generate)");
  return checker.status();
}

std::string_view to_string(SurfaceGuidance guidance) { return word_of(guidance, kGuidanceWords); }
std::string_view to_string(OutsideRegion outside) { return word_of(outside, kOutsideWords); }
std::string_view to_string(Carry carry) { return word_of(carry, kCarryWords); }

}  // namespace brainshift
