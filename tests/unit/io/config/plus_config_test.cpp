// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/plus_config.hpp"

#include <gmock/gmock.h>

#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::expect_edits_refused;
using test_support::TemporaryFolder;

const char* const kGood = R"(<PlusConfiguration version="2.1">
  <DataCollection><Device Id="x"/></DataCollection>
  <CoordinateDefinitions>
    <Transform From="Image" To="Probe"
      Matrix="
        0.1  0    0   1
        0   0.2   0   2
        0    0   0.1  3e0
        0    0    0   1" Error="0.508" Date="2011.08.19 14:11:53" />
    <Transform From="Phantom" To="Reference" Matrix="0 -1 0 5  1 0 0 6  0 0 1 7  0 0 0 1" />
  </CoordinateDefinitions>
  <VolumeReconstruction ClipRectangleOrigin="167 62" ClipRectangleSize="495 488" OutputSpacing="0.5 0.5 0.4"/>
</PlusConfiguration>)";

Result<PlusConfig> read_plus(const std::string& text) {
  const TemporaryFolder folder;
  auto config = read_plus_config(folder.write("device.xml", text));
  if (!config) {
    EXPECT_THAT(config.error().message, testing::HasSubstr("device.xml: "));
  }
  return config;
}

TEST(PlusConfig, ReadsTransformsAndReconstruction) {
  const auto config = value_or_fail(read_plus(kGood));
  ASSERT_EQ(config.transforms.size(), 2U);
  const PlusTransform& image = config.transforms[0];
  EXPECT_EQ(image.link.frames.name(), "ImageToProbe");
  EXPECT_TRUE((image.link.T_to_from * Vec3(10, 20, 0)).isApprox(Vec3(2, 6, 3)));
  EXPECT_EQ(image.error, 0.508);
  EXPECT_EQ(image.date, "2011.08.19 14:11:53");
  EXPECT_FALSE(config.transforms[1].error);
  ASSERT_TRUE(config.clip);
  EXPECT_THAT(config.clip->origin_px, testing::ElementsAre(167, 62));
  EXPECT_THAT(config.clip->size_px, testing::ElementsAre(495, 488));
  EXPECT_EQ(*config.output_spacing_mm, Vec3(0.5, 0.5, 0.4));
}

TEST(PlusConfig, NamesTransformAndAttributeThatAreWrong) {
  expect_edits_refused(
      read_plus, kGood,
      {{"3e0", "", "Transform ImageToProbe: Matrix is not 16 numbers"},
       {"3e0", "3 9", "Transform ImageToProbe: Matrix is not 16 numbers"},
       {"3e0", "far", "Transform ImageToProbe: Matrix is not 16 numbers"},
       {"0.1  0    0   1", "0 0 0 1", "ImageToProbe: Matrix cannot be inverted"},
       {"0 -1 0 5", "0 -1.1 0 5", "Transform PhantomToReference: Matrix is no rigid"},
       {"0 -1 0 5", "0 1 0 5", "reflection"},
       {"From=\"Phantom\"", "", "without From or To"},
       {"\"495 488\"", "\"495\"", "ClipRectangleSize = \"495\""},
       {"\"167 62\"", "\"-1 62\"", "ClipRectangleOrigin = \"-1 62\""},
       {"0.5 0.5 0.4", "0.5 0 0.4", "OutputSpacing = \"0.5 0 0.4\""},
       {"</PlusConfiguration>", "", "is no XML"},
       {"<PlusConfiguration", "<Other", "XML"}});
  refusal_of(read_plus_config("/nowhere/none.xml"), ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io
