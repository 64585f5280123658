// SPDX-License-Identifier: Apache-2.0
#include "common/configuration/case_keys.hpp"

#include <gmock/gmock.h>

#include <cstdlib>
#include <set>
#include <utility>

#include "tests/support/key_documenter.hpp"

namespace brainshift {
namespace {

using testing::ElementsAre;
using testing::Pair;

// Counts the calls of a table, a section as one.
struct Counter {
  int keys = 0;
  int depth = 0;
  template <typename... More>
  void operator()(const Key&, const More&...) {
    if (depth == 0) ++keys;
  }
  template <typename Body>
  void section(const Key&, Need, Body&& body) {
    body();
  }
  template <typename... More>
  void one_of(const Key&, const More&...) {
    ++keys;
  }
  template <typename... More>
  void section_if(const Key&, const More&...) {
    ++keys;
  }
  template <typename... More>
  void sections(const Key&, const More&...) {
    ++keys;
  }
};

// The number of members of an aggregate: the most values that its braces take.
struct Anything {
  template <typename T>
  operator T&() const noexcept {  // NOLINT: implicit, never called
    std::abort();
  }
};
template <typename T, std::size_t... I>
constexpr bool takes(std::index_sequence<I...>) {
  return requires { T{(void(I), Anything{})...}; };
}
template <typename T, std::size_t N = 40>
constexpr int members() {
  if constexpr (takes<T>(std::make_index_sequence<N>())) {
    return static_cast<int>(N);
  } else {
    return members<T, N - 1>();
  }
}

template <typename T>
int keys_of() {
  Counter counter;
  T value{};
  visit(counter, value);
  return counter.keys;
}
template <typename T>
int keys_of_kind() {
  Counter counter;
  T value{};
  visit_kind(counter, value);
  return counter.keys;
}

TEST(CaseKeys, EveryMemberHasAKey) {
  EXPECT_EQ(keys_of_kind<MeshGeneration>(), members<MeshGeneration>());
  EXPECT_EQ(keys_of_kind<MeshFile>(), members<MeshFile>());
  EXPECT_EQ(keys_of_kind<TumourEllipsoid>(), members<TumourEllipsoid>());
  EXPECT_EQ(keys_of_kind<TumourLabel>(), members<TumourLabel>());
  EXPECT_EQ(keys_of_kind<TumourSurfaceFile>(), members<TumourSurfaceFile>());
  EXPECT_EQ(keys_of<Craniotomy>(), members<Craniotomy>());
  EXPECT_EQ(keys_of<Brainstem>(), members<Brainstem>());
  EXPECT_EQ(keys_of<TissueStiffness>(), members<TissueStiffness>());
  EXPECT_EQ(keys_of<Material>(), members<Material>() - 1 + members<TissueRatios>());
  EXPECT_EQ(keys_of<AnatomyConfig>(), members<AnatomyConfig>());
  EXPECT_EQ(keys_of<ContactConfig>(), members<ContactConfig>());
  EXPECT_EQ(keys_of<PriorConfig>(), members<PriorConfig>());
  EXPECT_EQ(keys_of<InversionConfig>(), members<InversionConfig>());
  EXPECT_EQ(keys_of<SensingConfig>(), members<SensingConfig>());
  EXPECT_EQ(keys_of<CondensedConfig>(), members<CondensedConfig>());
  EXPECT_EQ(keys_of<SceneConfig>(), members<SceneConfig>());
}

TEST(CaseKeys, EveryKeyIsNamedOnceAndSaysWhatItMeans) {
  std::set<std::string> keys;
  for (const KeyDocument& document : documents_of<CaseConfig>()) {
    EXPECT_TRUE(keys.insert(document.key).second) << document.key;
    EXPECT_NE(document.text.substr(0, 1), " ") << document.key << " has no meaning";
  }
  EXPECT_EQ(keys.count("prior.tumour_volume_strain_sd"), 1u);
  EXPECT_EQ(keys.count("tumour.label_volume.label"), 1u);
  EXPECT_EQ(keys.count("material.tumour.poisson_ratio"), 1u);
}

TEST(CaseKeys, FilesAreNamedByTheirKeys) {
  CaseConfig config;
  config.mri = "t1.nii";
  config.brain = "mask.nii";
  config.tumour = TumourLabel{"labels.nii", {2}};
  config.contact.skull_file = "skull.stl";
  const auto pairs = [](const std::vector<NamedFile>& files) {
    std::vector<std::pair<std::string, std::string>> list;
    for (const NamedFile& file : files) list.emplace_back(file.key, file.path.string());
    return list;
  };
  EXPECT_THAT(pairs(named_files(config)),
              ElementsAre(Pair("images.mri", "t1.nii"), Pair("images.brain", "mask.nii"),
                          Pair("tumour.label_volume.file", "labels.nii"),
                          Pair("contact.skull_file", "skull.stl")));
  // The mask is not read beside a ready mesh.
  config.mri.clear();
  config.mesh = MeshFile{"head.msh"};
  config.tumour = TumourSurfaceFile{"tumour.stl"};
  config.contact.skull_file.reset();
  EXPECT_THAT(pairs(named_files(config)), ElementsAre(Pair("mesh.file", "head.msh"),
                                                      Pair("tumour.surface.file", "tumour.stl")));
}

TEST(CaseKeys, AKeyIsFoundByItsMember) {
  CaseConfig config;
  config.contact.skull_file = "skull.stl";
  EXPECT_EQ(key_of(config, config.mri), "images.mri");
  EXPECT_EQ(key_of(config, *config.contact.skull_file), "contact.skull_file");
  EXPECT_EQ(key_of(config, "images.mri"), "");
}

}  // namespace
}  // namespace brainshift
