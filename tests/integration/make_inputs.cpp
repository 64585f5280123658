// SPDX-License-Identifier: GPL-3.0-or-later
// integration_inputs FOLDER: files of known scenes that the generators of tests/support make, for
// the tests of the commands (inputs.py). Into folders that exist:
//   toy/     m.h5 and a.surgery: the toy patient, and a journal with updates 1 good, 2 caution,
//            3 unusable
//   stereo/  model.h5 and other.h5: two toy patients; left.pgm, right.pgm and calibration.yaml: a
//            patch over the craniotomy, seen by the operating rig; l0.pgm to r5.pgm: a board of
//            9 x 6 corners, 8 mm apart, in six poses
//   sweep/   sweep.igs.mha, device.xml, contours.csv, registration.txt: a sweep over the coarse
//            case's tumour, 2 mm lower
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "common/io/config/calibration_file.hpp"
#include "tests/support/stereo_scene.hpp"
#include "tests/support/toy_journal.hpp"
#include "tests/support/virtual_sweep.hpp"

namespace brainshift::test_support {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, const std::string& content) {
  std::ofstream stream(path, std::ios::binary);
  stream << content;
  stream.close();
  if (!stream) throw std::runtime_error("cannot write " + path.string());
}

void write(const fs::path& path, const stereo::GrayImage& image) {
  write(path, fmt::format("P5\n{} {}\n255\n", image.width, image.height) +
                  std::string(image.pixels.begin(), image.pixels.end()));
}

void make_toy(const fs::path& folder) {
  const BrainModel model = toy_model();
  write_toy_model(folder / "m.h5", model);
  write_toy_journal(
      folder / "a.surgery", model,
      {toy_update(model, 1, Quality::kGood, 0.5), toy_update(model, 2, Quality::kCaution),
       toy_update(model, 3, Quality::kUnusable)});
}

void make_stereo(const fs::path& folder) {
  write_toy_model(folder / "model.h5", toy_model(5));
  write_toy_model(folder / "other.h5", toy_model(6));
  const StereoCalibration rig = operating_rig();
  Patch patch;
  patch.radius_mm = 35.0;
  write(folder / "left.pgm", render(rig, Eye::kLeft, patch, 1));
  write(folder / "right.pgm", render(rig, Eye::kRight, patch, 2));
  write(folder / "calibration.yaml", io::calibration_text(rig));
  const stereo::ChessBoard board{9, 6, 8.0};
  for (int i = 0; i < 6; ++i) {
    const RigidTransform T = board_pose(i, board);
    write(folder / fmt::format("l{}.pgm", i), render(rig, Eye::kLeft, board, T));
    write(folder / fmt::format("r{}.pgm", i), render(rig, Eye::kRight, board, T));
  }
}

void make_sweep(const fs::path& folder) {
  VirtualSweep sweep;
  sweep.centre_mm = Vec3(46.0, -47.0, 7.0);
  sweep.semi_axes_mm = Vec3(16.0, 13.5, 12.146617);
  sweep.travel_mm = 18.0;
  sweep.width = 240, sweep.height = 200;
  std::string contours = "frame,u_px,v_px\n";
  for (int frame = 0; frame < sweep.frames; ++frame) {
    const auto contour = sweep.section(frame, 90);
    for (const auto& point : contour.points_px.colwise()) {
      contours += fmt::format("{},{:.6g},{:.6g}\n", frame, point.x(), point.y());
    }
  }
  write(folder / "sweep.igs.mha", meta_text(sweep.content(), true));
  write(folder / "device.xml", sweep.device_text());
  write(folder / "contours.csv", contours);
  write(folder / "registration.txt", matrix_text(sweep.T_ras_reference().matrix()));
}

}  // namespace
}  // namespace brainshift::test_support

int main(int argc, char** argv) {
  using namespace brainshift::test_support;
  if (argc != 2) {
    std::fputs("usage: integration_inputs FOLDER\n", stderr);
    return 2;
  }
  const fs::path folder = argv[1];
  try {
    make_toy(folder / "toy");
    make_stereo(folder / "stereo");
    make_sweep(folder / "sweep");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "integration_inputs: %s\n", error.what());
    return 1;
  }
  return 0;
}
