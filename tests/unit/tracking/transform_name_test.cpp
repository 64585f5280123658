// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/tracking/transform_name.hpp"

#include <gmock/gmock.h>

#include "tests/support/results.hpp"

namespace brainshift::tracking {
namespace {

TEST(TransformName, IsCutAtToBeforeACapital) {
  for (const auto& [name, from, to] :
       {std::tuple{"ProbeToTracker", "Probe", "Tracker"},
        std::tuple{"ToolToTracker", "Tool", "Tracker"},
        std::tuple{"StylusTipToStylus", "StylusTip", "Stylus"},
        std::tuple{"ImageToCroppedImage", "Image", "CroppedImage"},
        std::tuple{"PhantomReferenceToTop", "PhantomReference", "Top"}}) {
    const auto frames = parse_transform_name(name);
    ASSERT_TRUE(frames) << name;
    EXPECT_EQ(frames->from, from);
    EXPECT_EQ(frames->to, to);
    EXPECT_EQ(frames->name(), name);
  }
}

TEST(TransformName, ThatSaysNoPairIsRefusedByName) {
  for (const char* name : {"", "To", "Probe", "ProbeTo", "ToTracker", "probeToTracker",
                           "ProbeTotracker", "AToBToC", "ProbetoTracker"}) {
    EXPECT_THAT(refusal_of(parse_transform_name(name), ErrorCode::kInvalidArgument),
                testing::HasSubstr(std::string(name)));
  }
}

TEST(TransformName, OnlyImageFramesMayScale) {
  EXPECT_TRUE(is_image_frame("Image"));
  EXPECT_TRUE(is_image_frame("CroppedImage"));
  EXPECT_FALSE(is_image_frame("Probe"));
  EXPECT_FALSE(is_image_frame("ImageHolder"));
}

}  // namespace
}  // namespace brainshift::tracking
