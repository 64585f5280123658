// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/anatomy/brain_labels.hpp"

#include <gmock/gmock.h>

#include <numeric>

#include "tests/support/results.hpp"

namespace brainshift::anatomy {
namespace {

using testing::HasSubstr;

// A cube of cerebrum (41) of 30 voxels' side about a sulcus of fluid, 4 voxels wide, on a
// brainstem.
VoxelImage labelled_head() {
  VoxelImage map;
  map.dims = {50, 50, 50};
  for (int k = 0; k < 50; ++k) {
    for (int j = 0; j < 50; ++j) {
      for (int i = 0; i < 50; ++i) {
        const bool across = i >= 10 && i < 40 && j >= 10 && j < 40;
        const bool sulcus = i >= 23 && i < 27 && k >= 20;
        const bool stem = i >= 20 && i < 30 && j >= 20 && j < 30 && k < 10 && k >= 4;
        float label = 507.0F;  // scalp
        if (across && k >= 10 && k < 40) label = sulcus ? 24.0F : 41.0F;
        if (stem) label = 16.0F;
        map.values.push_back(label);
      }
    }
  }
  return map;
}

float voxels_of(const VoxelImage& image) {
  return std::accumulate(image.values.begin(), image.values.end(), 0.0F);
}

TEST(BrainLabels, NumbersAreFreeSurfers) {
  EXPECT_EQ(structure_of(16), Structure::kBrainstem);
  EXPECT_EQ(structure_of(43), Structure::kVentricle);
  EXPECT_EQ(structure_of(2035), Structure::kCerebrum);
  EXPECT_EQ(structure_of(507), Structure::kOther);
  EXPECT_EQ(structure_of(0), Structure::kOther);
}

TEST(BrainLabels, TheMaskIsTheTissueWithItsSulciClosed) {
  const auto mask = value_or_fail(brain_from_labels(labelled_head()));
  EXPECT_EQ(voxels_of(mask), 30.0F * 30 * 30 + 10 * 10 * 6);
  EXPECT_EQ(voxels_of(value_or_fail(brain_from_labels(labelled_head(), 0.0))),
            30.0F * 30 * 30 - 4 * 30 * 20 + 10 * 10 * 6);
}

TEST(BrainLabels, NamesOfATableGiveTheSameMask) {
  VoxelImage own = labelled_head();
  for (float& v : own.values) v = v == 41.0F ? 1.0F : v == 16.0F ? 2.0F : v == 24.0F ? 3.0F : 0.0F;
  const auto renamed = value_or_fail(with_freesurfer_numbers(
      own, {{1, "right cerebral_white matter"}, {2, "Brain-Stem"}, {3, "CSF"}, {4, "Nose"}}));
  EXPECT_EQ(voxels_of(value_or_fail(brain_from_labels(renamed))),
            voxels_of(value_or_fail(brain_from_labels(labelled_head()))));
  EXPECT_THAT(refusal_of(with_freesurfer_numbers(own, {{1, "GM"}}), ErrorCode::kInvalidArgument),
              HasSubstr("FreeSurfer's"));
}

TEST(BrainLabels, AMapOfOtherNumbersIsRefusedWithItsLabels) {
  VoxelImage tissue = labelled_head();
  for (float& v : tissue.values) v = v == 41.0F ? 2.0F : 0.0F;
  EXPECT_THAT(refusal_of(brain_from_labels(tissue), ErrorCode::kInvalidArgument),
              HasSubstr("it has 2 ("));
}

TEST(BrainLabels, MoreThanABrainIsNone) {
  VoxelImage large = labelled_head();
  large.T_ras_voxel.linear() *= 4.8;
  EXPECT_THAT(refusal_of(brain_from_labels(large, 0.0), ErrorCode::kInvalidArgument),
              HasSubstr("cc of brain by FreeSurfer's numbers, at most 2500 are one"));
}

}  // namespace
}  // namespace brainshift::anatomy
