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
</PlusConfiguration>)";

Result<std::vector<tracking::ConstantLink>> read_plus(const std::string& text) {
  const TemporaryFolder folder;
  auto links = read_plus_config(folder.write("device.xml", text));
  if (!links) {
    EXPECT_THAT(links.error().message, testing::HasSubstr("device.xml: "));
  }
  return links;
}

TEST(PlusConfig, ReadsTransforms) {
  const auto links = value_or_fail(read_plus(kGood));
  ASSERT_EQ(links.size(), 2U);
  const tracking::ConstantLink& image = links.front();
  EXPECT_EQ(image.frames.name(), "ImageToProbe");
  EXPECT_TRUE((image.T_to_from * Vec3(10, 20, 0)).isApprox(Vec3(2, 6, 3)));
}

TEST(PlusConfig, NamesTransformThatIsWrong) {
  expect_edits_refused(
      read_plus, kGood,
      {{"3e0", "", "Transform ImageToProbe: Matrix is not 16 numbers"},
       {"3e0", "3 9", "Transform ImageToProbe: Matrix is not 16 numbers"},
       {"3e0", "far", "Transform ImageToProbe: Matrix is not 16 numbers"},
       {"0.1  0    0   1", "0 0 0 1", "ImageToProbe: Matrix cannot be inverted"},
       {"0 -1 0 5", "0 -1.1 0 5", "Transform PhantomToReference: Matrix is no rigid"},
       {"0 -1 0 5", "0 1 0 5", "reflection"},
       {"From=\"Phantom\"", "", "without From or To"},
       {"</PlusConfiguration>", "", "is no XML"},
       {"<PlusConfiguration", "<Other", "XML"}});
  refusal_of(read_plus_config("/nowhere/none.xml"), ErrorCode::kNotFound);
}

}  // namespace
}  // namespace brainshift::io
