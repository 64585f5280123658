// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/mgh_file.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "common/io/geometry/label_map_file.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

// A volume of 2 x 3 x 4 int16 voxels in FreeSurfer's usual directions (-R, -S, +A) with steps of 1,
// 2 and 3 mm; voxel n has the value n.
class MghBytes {
 public:
  MghBytes() : bytes_(284, '\0') {
    for (const auto& [at, value] : {std::pair{0, 1}, {4, 2}, {8, 3}, {12, 4}, {16, 1}, {20, 4}}) {
      set<std::int32_t>(static_cast<std::size_t>(at), value);
    }
    set<std::int16_t>(28, 1);
    const float reals[15] = {1, 2, 3, -1, 0, 0, 0, 0, -1, 0, 1, 0, 10, 20, 30};
    for (std::size_t i = 0; i < 15; ++i) set<float>(30 + 4 * i, reals[i]);
    for (std::int16_t n = 0; n < 24; ++n) {
      bytes_.append(2, '\0');
      set<std::int16_t>(bytes_.size() - 2, n);
    }
  }
  template <typename T>
  MghBytes& set(std::size_t at, T value) {
    std::memcpy(&bytes_[at], &value, sizeof value);
    std::reverse(&bytes_[at], &bytes_[at] + sizeof value);
    return *this;
  }
  std::string bytes_;
};

TEST(MghFile, VoxelsLieAboutTheCentreThatTheHeaderNames) {
  const TemporaryFolder folder;
  const auto image = value_or_fail(read_volume(folder.write("a.mgz", MghBytes().bytes_)));
  EXPECT_THAT(image.dims, ElementsAre(2, 3, 4));
  EXPECT_EQ(image.at(1, 2, 3), 23.0F);
  EXPECT_TRUE((image.T_ras_voxel * Vec3(1, 1.5, 2)).isApprox(Vec3(10, 20, 30)));
  EXPECT_TRUE((image.T_ras_voxel * Vec3(0, 0.5, 3)).isApprox(Vec3(11, 23, 32)));
}

TEST(MghFile, WhatIsWrongIsNamed) {
  const TemporaryFolder folder;
  const auto refusal = [&](const MghBytes& of, std::size_t cut = 0) {
    return refusal_of(read_mgh(folder.write("a.mgz", of.bytes_.substr(0, of.bytes_.size() - cut))));
  };
  EXPECT_THAT(refusal(MghBytes().set<std::int32_t>(0, 2)), HasSubstr("is not a volume of FreeS"));
  EXPECT_THAT(refusal(MghBytes().set<std::int32_t>(8, -3)), HasSubstr("-3 voxels along axis 1"));
  EXPECT_THAT(refusal(MghBytes().set<std::int32_t>(16, 5)), HasSubstr("has 5 frames"));
  EXPECT_THAT(refusal(MghBytes().set<std::int32_t>(20, 2)), HasSubstr("type = 2"));
  EXPECT_THAT(refusal(MghBytes().set<std::int16_t>(28, 0)), HasSubstr("goodRASFlag"));
  EXPECT_THAT(refusal(MghBytes().set<float>(30, 0.0F)), HasSubstr("dependent"));
  EXPECT_THAT(refusal(MghBytes(), 1), HasSubstr("a.mgz: is truncated"));
  EXPECT_THAT(refusal(MghBytes().set<std::int32_t>(12, 32767)), HasSubstr("is truncated"));
}

}  // namespace
}  // namespace brainshift::io
