// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/report/figures.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/geometry/surface.hpp"
#include "tests/unit/client/tools/replay/box.hpp"

namespace brainshift::client {
namespace {

using testing::HasSubstr;

TEST(Figures, OfAGroupShowEveryPictureThatItsDataAllow) {
  Head head;
  head.tumour = geometry::ellipsoid_surface(Vec3(5, 5, 5), Vec3(2, 2, 2), 0.5);
  head.tumour_centre = head.craniotomy_centre = Vec3(5, 5, 5);
  head.gravity_direction = Vec3(-1, 0, 0);
  std::vector<ReportedRun> runs(2);
  for (std::size_t i = 0; i < 2; ++i) {
    runs[i].report.scenario = "a b/c";
    runs[i].report.method = "condensed";
    runs[i].report.boundary = i == 0 ? "contact" : "fixed";
    RunField field{box_mesh(), 0.1 * box_mesh().nodes, Points(0.12 * box_mesh().nodes)};
    runs[i].field = std::move(field);
  }
  auto groups = group_runs(runs);
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups[0].name, "a-b-c");
  auto figures = slice_figures(groups[0], runs, head);
  EXPECT_EQ(figures.size(), 6u);
  for (const Figure& figure : figures) {
    EXPECT_FALSE(figure.image.empty()) << figure.file_name;
    EXPECT_THAT(figure.caption, HasSubstr("a b/c, method condensed, contact and fixed boundary"));
  }
  const std::vector<ReportedRun> alone = {runs[1]};
  for (const Figure& figure : slice_figures(group_runs(alone)[0], alone, head)) {
    EXPECT_THAT(figure.caption, HasSubstr("a b/c, method condensed, fixed boundary"));
  }

  for (ReportedRun& run : runs) run.field->truth.reset();
  EXPECT_EQ(slice_figures(groups[0], runs, head).size(), 4u);
  for (ReportedRun& run : runs) run.field.reset();
  EXPECT_TRUE(slice_figures(groups[0], runs, head).empty());
}

}  // namespace
}  // namespace brainshift::client
