// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/plus_config.hpp"

#include <gmock/gmock.h>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;

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

std::string plus_refusal(const std::string& what, const std::string& with) {
  std::string text = kGood;
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  text.replace(at, what.size(), with);
  const TemporaryFolder folder;
  const auto config = read_plus_config(folder.write("device.xml", text));
  if (config) return {};
  EXPECT_EQ(config.error().code, ErrorCode::kUnreadable);
  EXPECT_THAT(config.error().message, HasSubstr("device.xml: "));
  return config.error().message;
}

TEST(PlusConfig, ReadsTransformsAndReconstruction) {
  const TemporaryFolder folder;
  const auto config = read_plus_config(folder.write("device.xml", kGood));
  ASSERT_TRUE(config) << config.error().message;
  ASSERT_EQ(config->transforms.size(), 2U);
  const PlusTransform& image = config->transforms[0];
  EXPECT_EQ(image.link.frames.name(), "ImageToProbe");
  EXPECT_TRUE((image.link.T_to_from * Vec3(10, 20, 0)).isApprox(Vec3(2, 6, 3)));
  EXPECT_EQ(image.error, 0.508);
  EXPECT_EQ(image.date, "2011.08.19 14:11:53");
  EXPECT_FALSE(config->transforms[1].error);
  ASSERT_TRUE(config->clip);
  EXPECT_THAT(config->clip->origin_px, testing::ElementsAre(167, 62));
  EXPECT_THAT(config->clip->size_px, testing::ElementsAre(495, 488));
  EXPECT_EQ(*config->output_spacing_mm, Vec3(0.5, 0.5, 0.4));
}

TEST(PlusConfig, NamesTransformAndAttributeThatAreWrong) {
  EXPECT_THAT(plus_refusal("3e0", ""),
              HasSubstr("Transform ImageToProbe: Matrix is not 16 numbers"));
  EXPECT_THAT(plus_refusal("3e0", "3 9"),
              HasSubstr("Transform ImageToProbe: Matrix is not 16 numbers"));
  EXPECT_THAT(plus_refusal("3e0", "far"),
              HasSubstr("Transform ImageToProbe: Matrix is not 16 numbers"));
  EXPECT_THAT(plus_refusal("0.1  0    0   1", "0 0 0 1"),
              HasSubstr("ImageToProbe: Matrix cannot be inverted"));
  EXPECT_THAT(plus_refusal("0 -1 0 5", "0 -1.1 0 5"),
              HasSubstr("Transform PhantomToReference: Matrix is no rigid"));
  EXPECT_THAT(plus_refusal("0 -1 0 5", "0 1 0 5"), HasSubstr("reflection"));
  EXPECT_THAT(plus_refusal("From=\"Phantom\"", ""), HasSubstr("without From or To"));
  EXPECT_THAT(plus_refusal("\"495 488\"", "\"495\""), HasSubstr("ClipRectangleSize = \"495\""));
  EXPECT_THAT(plus_refusal("\"167 62\"", "\"-1 62\""),
              HasSubstr("ClipRectangleOrigin = \"-1 62\""));
  EXPECT_THAT(plus_refusal("0.5 0.5 0.4", "0.5 0 0.4"), HasSubstr("OutputSpacing = \"0.5 0 0.4\""));
  EXPECT_THAT(plus_refusal("</PlusConfiguration>", ""), HasSubstr("is no XML"));
  EXPECT_THAT(plus_refusal("<PlusConfiguration", "<Other"), HasSubstr("XML"));
}

TEST(PlusConfig, AMissingFileIsNotFound) {
  const TemporaryFolder folder;
  const auto config = read_plus_config(folder / "none.xml");
  ASSERT_FALSE(config);
  EXPECT_EQ(config.error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io
