// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/tracking/transform_graph.hpp"
#include "tests/support/results.hpp"

#include <gmock/gmock.h>

namespace brainshift::tracking {
namespace {

using testing::HasSubstr;

const std::vector<FramePair> kLinks = {{"Image", "Probe"},
                                       {"Probe", "Tracker"},
                                       {"Reference", "Tracker"},
                                       {"Reference", "Ras"},
                                       {"Phantom", "Rack"}};

TEST(ShortestChain, WalksLinksForwardsAndBackwards) {
  const auto chain = value_or_fail(shortest_chain(kLinks, "Image", "Ras"));
  ASSERT_EQ(chain.size(), 4U);
  const std::vector<bool> inverted = {false, false, true, false};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(chain[i].link, i);
    EXPECT_EQ(chain[i].inverted, inverted[i]) << i;
  }
}

TEST(ShortestChain, BackIsTheSameInReverse) {
  const auto there = value_or_fail(shortest_chain(kLinks, "Image", "Ras"));
  const auto back = value_or_fail(shortest_chain(kLinks, "Ras", "Image"));
  ASSERT_EQ(there.size(), back.size());
  for (std::size_t i = 0; i < there.size(); ++i) {
    const ChainStep& mirror = back[back.size() - 1 - i];
    EXPECT_EQ(there[i].link, mirror.link);
    EXPECT_NE(there[i].inverted, mirror.inverted);
  }
}

TEST(ShortestChain, PrefersTheShorterOfTwoWays) {
  std::vector<FramePair> links = kLinks;
  links.push_back({"Image", "Reference"});
  const auto chain = value_or_fail(shortest_chain(links, "Image", "Ras"));
  ASSERT_EQ(chain.size(), 2U);
  EXPECT_EQ(chain[0].link, 5U);
}

TEST(ShortestChain, FromAFrameToItselfHasNoSteps) {
  const auto chain = value_or_fail(shortest_chain(kLinks, "Probe", "Probe"));
  EXPECT_TRUE(chain.empty());
}

TEST(ShortestChain, ThatDoesNotExistNamesWhatIsConnected) {
  std::vector<FramePair> links = kLinks;
  links.erase(links.begin() + 2);  // Reference loses the tracker
  EXPECT_EQ(refusal_of(shortest_chain(links, "Image", "Ras"), ErrorCode::kInvalidArgument),
            "no chain from Image to Ras: Image is connected to Image, Probe, Tracker; other known "
            "frames: "
            "Phantom, Rack, Ras, Reference");
}

TEST(ShortestChain, ToAnUnknownFrameSaysSo) {
  EXPECT_THAT(sentence_of(shortest_chain(kLinks, "Image", "Patient")),
              HasSubstr("no chain from Image to Patient"));
}

TEST(ShortestChain, TwoLinksBetweenTheSameFramesAreRefused) {
  std::vector<FramePair> links = kLinks;
  links.push_back({"Probe", "Image"});
  EXPECT_THAT(sentence_of(shortest_chain(links, "Image", "Ras")),
              HasSubstr("ImageToProbe and ProbeToImage"));
}

TEST(ShortestChain, ALinkFromAFrameToItselfIsRefused) {
  EXPECT_THAT(sentence_of(shortest_chain({{"Probe", "Probe"}}, "Probe", "Probe")),
              HasSubstr("ProbeToProbe"));
}

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
                HasSubstr(std::string(name)));
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
