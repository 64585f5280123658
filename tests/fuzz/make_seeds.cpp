// SPDX-License-Identifier: GPL-3.0-or-later
// make_seeds OUT: small valid inputs of every fuzz target, OUT/TARGET/NAME, by the project's own
// writers where there is one, and the examples of the repository.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "common/io/geometry/mesh_writer.hpp"
#include "common/io/model/model_file.hpp"
#include "common/io/recording/surgery_file.hpp"
#include "tests/support/dicom_files.hpp"
#include "tests/support/virtual_sweep.hpp"
#include "tests/unit/io/model/model_file_example.hpp"

namespace brainshift::fuzz {
namespace {

namespace fs = std::filesystem;

void check(const Status& status) {
  if (!status) throw std::runtime_error(status.error().message);
}

class Seeds {
 public:
  explicit Seeds(fs::path out) : out_(std::move(out)) { fs::remove_all(out_); }
  fs::path path(const std::string& target, const std::string& name) const {
    fs::create_directories(out_ / target);
    return out_ / target / name;
  }
  void write(const std::string& target, const std::string& name, const std::string& bytes) const {
    std::ofstream(path(target, name), std::ios::binary) << bytes;
  }
  void copy(const std::string& target, const fs::path& file) const {
    const std::string name =
        file.parent_path().filename().string() + "-" + file.filename().string();
    fs::copy_file(fs::path(BRAINSHIFT_SOURCE_DIR) / file, path(target, name));
  }
  void copy_all(const std::string& target, const fs::path& folder,
                const std::string& extension) const {
    for (const auto& entry : fs::directory_iterator(fs::path(BRAINSHIFT_SOURCE_DIR) / folder)) {
      if (entry.path().extension() == extension) copy(target, folder / entry.path().filename());
    }
  }

 private:
  fs::path out_;
};

// A NIfTI-1 header by the standard's offsets, and 2 x 2 x 2 voxels.
std::string nifti() {
  std::string bytes(352, '\0');
  const auto put = [&bytes](std::size_t at, auto number) {
    std::memcpy(bytes.data() + at, &number, sizeof number);
  };
  put(0, std::int32_t{348});
  for (std::size_t i = 0; i < 4; ++i) put(40 + 2 * i, static_cast<std::int16_t>(i == 0 ? 3 : 2));
  put(70, std::int16_t{4});  // int16
  put(72, std::int16_t{16});
  for (std::size_t i = 0; i < 4; ++i) put(76 + 4 * i, 1.0F);
  put(108, 352.0F);
  bytes[123] = 2;  // mm
  put(252, std::int16_t{1});
  put(254, std::int16_t{1});
  for (std::size_t i = 0; i < 3; ++i) put(280 + 20 * i, 1.0F);
  std::memcpy(bytes.data() + 344, "n+1", 4);
  return bytes + std::string(16, '\1');
}

TetMesh tetrahedron() {
  TetMesh mesh;
  mesh.nodes = Points::Zero(3, 4);
  mesh.nodes.rightCols(3).setIdentity();
  mesh.tets.resize(4, 1);
  mesh.tets << 0, 1, 2, 3;
  mesh.labels = {1};
  return mesh;
}

void surfaces(const Seeds& seeds) {
  TriangleSurface triangle;
  triangle.vertices = Points::Identity(3, 3);
  triangle.triangles.resize(3, 1);
  triangle.triangles << 0, 1, 2;
  for (const char* name : {"written.ply", "written.vtp"}) {
    check(io::write_surface(seeds.path("surface", name), triangle));
  }
  seeds.write("surface", "text.stl",
              "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
              "vertex 0 1 0\nendloop\nendfacet\nendsolid s\n");
  seeds.write("surface", "lps.stl",
              "solid 3D Slicer output. SPACE=LPS\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"
              "vertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n");
  seeds.write(
      "surface", "lps.vtp",
      "<VTKFile type=\"PolyData\"><PolyData><FieldData><Array type=\"String\" Name=\"SPACE\" "
      "NumberOfTuples=\"1\" format=\"ascii\">76 80 83 0</Array></FieldData><Piece "
      "NumberOfPoints=\"3\" NumberOfPolys=\"1\"><Points><DataArray type=\"Float32\" "
      "NumberOfComponents=\"3\">0 0 0 1 0 0 0 1 0</DataArray></Points><Polys><DataArray "
      "type=\"Int32\" Name=\"connectivity\">0 1 2</DataArray><DataArray type=\"Int32\" "
      "Name=\"offsets\">3</DataArray></Polys></Piece></PolyData></VTKFile>\n");
  std::string binary(80, ' ');
  const std::uint32_t count = 1;
  const float facet[12] = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
  binary.append(reinterpret_cast<const char*>(&count), sizeof count);
  binary.append(reinterpret_cast<const char*>(facet), sizeof facet);
  seeds.write("surface", "binary.stl", binary + std::string(2, '\0'));
  seeds.write("surface", "text.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 -1//1\n");
  seeds.write("surface", "text.ply",
              "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
              "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
              "end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  seeds.write("surface", "points.csv", "0,0,0\n1,0,0\n0,1,0\n");
}

void label_maps(const Seeds& seeds) {
  const std::string space =
      "space: left-posterior-superior\nspace directions: none (1,0,0) (0,1,0) (0,0,2)\n"
      "space origin: (1,2,3)\nspace units: \"mm\" \"mm\" \"mm\"\n";
  const std::string keys =
      "Segment0_Name:=Head\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n"
      "Segment1_Name:=Mass\nSegment1_LabelValue:=2\nSegment1_Layer:=1\n";
  seeds.write("nrrd", "layers.seg.nrrd",
              "NRRD0004\ntype: unsigned short\ndimension: 4\nsizes: 2 2 1 1\nencoding: raw\n"
              "endian: big\nkinds: list domain domain domain\n" +
                  space + keys + "\n" + std::string({0, 1, 0, 2, 0, 1, 0, 0}));
  seeds.write("nrrd", "plain.nrrd",
              "NRRD0004\ntype: double\ndimension: 3\nsizes: 1 1 1\nencoding: raw\nspace: RAS\n"
              "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n\n" +
                  std::string(8, '\0'));
}

void landmarks(const Seeds& seeds) {
  seeds.write("landmarks", "a.tag",
              "MNI Tag Point File\nVolumes = 2;\n%\nPoints =\n 1 2 3 4 5 6 \"a\"\n"
              " 1 2 3 4 5 6 1 2 3;\n");
  seeds.write("landmarks", "a.csv",
              "label,x_src,y_src,z_src,x_dst,y_dst,z_dst\n\"a, b\",1,2,3,4,5,6\n");
  seeds.write("landmarks", "b.csv", "label,l,p,s\na,1,2,3\n");
  seeds.write("landmarks", "a.fcsv",
              "# CoordinateSystem = LPS\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label\n"
              "1,1,2,3,0,0,0,1,1,1,0,\"a\"\"\"\n");
  seeds.write(
      "landmarks", "a.mrk.json",
      R"({"markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "coordinateUnits": ["mm"],
                  "controlPoints": [{"label": "a", "position": [1, 2, 3],
                                     "positionStatus": "defined"}]}]})");
}

void sequences(const Seeds& seeds) {
  test_support::VirtualSweep sweep;
  sweep.width = 4, sweep.height = 3, sweep.frames = 2;
  const auto content = sweep.content();
  for (const bool packed : {false, true}) {
    const std::string end = packed ? "packed" : "plain";
    seeds.write("sequence", end + ".mha", test_support::meta_text(content, packed));
    seeds.write("sequence", end + ".nrrd", test_support::nrrd_text(content, packed));
  }
  auto tracker = content;  // alone
  tracker.width = tracker.height = 0;
  tracker.pixels.clear();
  seeds.write("sequence", "tracker.mha", test_support::meta_text(tracker, false));
  seeds.write("plus", "device.xml", sweep.device_text());
}

void surgeries(const Seeds& seeds) {
  auto file = io::SurgeryFile::create(seeds.path("surgery", "small.surgery"),
                                      {.case_id = "c", .model_id = "m", .seed = 1});
  if (!file) throw std::runtime_error(file.error().message);
  check(file->append({io::RecordKind::kObservation, 1, 10, "observation"}));
  check(file->append({io::RecordKind::kUpdate, 1, 20, "update"}));
  io::SurgeryTruth truth;
  truth.displacement = Points::Ones(3, 2);
  truth.points["cross"] = {io::ScorePoint{}};
  truth.scalars["fluid_level_mm"] = 1.0;
  check(file->write_truth(1, truth));
  check(file->close());
}

// 4 x 3 x 2 voxels with the labels 1 and 2.
void dicom(const Seeds& seeds) {
  VoxelImage labels;
  labels.dims = {4, 3, 2};
  labels.T_ras_voxel.linear().diagonal() << -1.0, -1.0, 2.0;
  labels.values.assign(labels.num_voxels(), 1.0F);
  labels.values.back() = 2.0F;
  const fs::path folder = seeds.path("series", "");
  test_support::write_series(folder, labels);
  for (const auto& entry : fs::directory_iterator(folder)) {
    fs::copy_file(entry.path(), seeds.path("dicom", entry.path().filename().string()));
  }
  fs::remove_all(folder);
  test_support::write_segmentation(seeds.path("dicom", "seg.dcm"), labels,
                                   {{1, "Tumour"}, {2, "Oedema"}});
  Points square(3, 4);
  square << 2, 9, 9, 2, 3, 3, 8, 8, 4, 4, 4, 4;
  test_support::write_structure_set(seeds.path("dicom", "rs.dcm"), {{{1, "GTV", {{square}}}}});
}

void make(const Seeds& seeds) {
  seeds.copy_all("wire", "tests/data/wire", ".bin");
  seeds.copy_all("igtl", "tests/data/igtl", ".bin");
  seeds.copy_all("case", "config/cases", ".yaml");
  seeds.copy("daemon", "config/daemon.yaml");
  seeds.copy("daemon", "docker/daemon.yaml");
  seeds.copy_all("problem", "docs/examples/solve", ".yaml");
  seeds.write("nifti", "small.nii", nifti());
  check(io::write_vtu(seeds.path("mesh", "written.vtu"), tetrahedron(), {}));
  seeds.write("mesh", "two.msh",
              "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"all\"\n"
              "$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
              "$Elements\n2\n1 4 2 1 1 1 2 3 4\n2 2 2 1 1 1 2 3\n$EndElements\n");
  seeds.write("mesh", "four.msh",
              "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n"
              "0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n"
              "$EndElements\n");
  surfaces(seeds);
  dicom(seeds);
  label_maps(seeds);
  landmarks(seeds);
  sequences(seeds);
  surgeries(seeds);
  check(io::write_model(seeds.path("model", "small.h5"), io::test_example::model_file()));
}

}  // namespace
}  // namespace brainshift::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_seeds OUT\n");
    return 2;
  }
  try {
    brainshift::fuzz::make(brainshift::fuzz::Seeds(argv[1]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_seeds: %s\n", error.what());
    return 1;
  }
  return 0;
}
