// SPDX-License-Identifier: GPL-3.0-or-later
// A case on disk that takes no time: a ready box of 80 mm with an ellipsoidal tumour, and its file.
#pragma once

#include <gtest/gtest.h>

#include "common/io/config/config_file.hpp"
#include "common/io/geometry/mesh_writer.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/anatomy/ball_case.hpp"

namespace brainshift::patient {

class BoxCase : public ::testing::Test {
 protected:
  BoxCase() {
    const Vec3 centre = anatomy::testing::kBallCentre;
    CaseConfig config = anatomy::testing::ball_case().config;
    config.brain.clear();
    config.mri.clear();
    config.mesh = MeshFile{folder_ / "box.vtu"};
    config.tumour = TumourEllipsoid{centre + Vec3(20, 0, 0), Vec3(10, 8, 6)};
    config.craniotomy.centre_mm = centre + Vec3(41, 3, 2);
    config.brainstem = {centre - Vec3(0, 0, 40), 16.0};
    config.condensed.max_rank = 40;
    config.condensed.uncertainty_nodes = 20;
    EXPECT_TRUE(io::write_vtu(
        folder_ / "box.vtu",
        test_support::box_mesh(centre - Vec3::Constant(40), centre + Vec3::Constant(40), 6), {}));
    case_file_ = folder_.write("case.yaml", io::case_config_text(config));
  }
  CaseConfig config() const { return value_or_fail(io::read_case_config(case_file_)); }

  test_support::TemporaryFolder folder_;
  std::filesystem::path case_file_;
};

}  // namespace brainshift::patient
