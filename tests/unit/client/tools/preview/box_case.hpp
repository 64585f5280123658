// SPDX-License-Identifier: GPL-3.0-or-later
// A case file whose brain is a box of 150 mm about the origin, with a tumour on the right.
#pragma once

#include <filesystem>
#include <string>

#include "common/io/geometry/mesh_writer.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/toy_patient.hpp"

namespace brainshift::client {

struct BoxCase {
  // In place of the ellipsoid.
  std::string tumour_volume = "";
  std::string tumour = "[40, -10, 20]";
  std::string craniotomy = "[75, -10, 20]";
  std::string gravity = "[-1, 0, 0]";  // the patient lies on the left side
  std::string brainstem = "[0, 0, -75]";
  double side_mm = 150.0;
  double stem_radius_mm = 30.0;
};

inline std::filesystem::path write_box_case(const test_support::TemporaryFolder& folder,
                                            const BoxCase& box = {}) {
  TetMesh mesh = test_support::toy_patient(8).mesh;  // a box from 0 to 60 mm
  mesh.nodes = (mesh.nodes.array() - 30.0) * (box.side_mm / 60.0);
  EXPECT_TRUE(io::write_vtu(folder / "box.vtu", mesh, {}));
  const std::string tumour =
      box.tumour_volume.empty()
          ? "ellipsoid: {centre_mm: " + box.tumour + ", semi_axes_mm: [12, 12, 12]}"
          : "label_volume: {file: " + box.tumour_volume + ", label: 1}";
  return folder.write("box.yaml", "case_id: box\nmesh: {file: box.vtu}\ntumour: {" + tumour +
                                      "}\ncraniotomy: {centre_mm: " + box.craniotomy +
                                      ", long_axis_mm: 60, short_axis_mm: 50, "
                                      "long_axis_direction: [0, 0, 1]}\nbrainstem: {centre_mm: " +
                                      box.brainstem +
                                      ", radius_mm: " + std::to_string(box.stem_radius_mm) +
                                      "}\ngravity: {direction: " + box.gravity +
                                      "}\ncontact: {slave_depth_mm: 40}\n");
}

}  // namespace brainshift::client
