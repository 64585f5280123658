// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model_file.hpp"

#include <gmock/gmock.h>
#include <zlib.h>

#include <iomanip>
#include <sstream>

#include "common/core/model_id.hpp"
#include "common/io/config_file.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::content_of;
using test_support::TemporaryFolder;

using testing::AnyOf;
using testing::HasSubstr;

// Values without symmetry, so that a swapped or transposed array shows.
ModelFile example() {
  ModelFile file;
  file.config = parse_case_config(R"(case_id: example
images: {brain: mask.nii}
tumour: {ellipsoid: {centre_mm: [1, 2, 3], semi_axes_mm: [4, 5, 6]}}
craniotomy: {centre_mm: [7, 8, 9]}
brainstem: {centre_mm: [0, 0, -60]}
gravity: {direction: [1, -2, 3]}
material: {poisson_ratio: 0.41}
)",
                                  "/cases/example.yaml")
                    .value();
  BrainModel& model = file.model;
  model.case_id = "example";
  model.mesh.nodes.resize(3, 5);
  for (Eigen::Index i = 0; i < 15; ++i) model.mesh.nodes.data()[i] = 0.1 * static_cast<double>(i);
  model.mesh.tets.resize(4, 2);
  model.mesh.tets << 0, 1, 1, 2, 2, 3, 3, 4;
  model.mesh.labels = {0, 3};
  model.boundary_triangles.resize(3, 2);
  model.boundary_triangles << 0, 1, 2, 3, 4, 0;
  model.skull.vertices = 2.0 * model.mesh.nodes.leftCols(4);
  model.skull.triangles.resize(3, 1);
  model.skull.triangles << 3, 1, 2;
  model.tumour.vertices = 0.3 * model.mesh.nodes.rightCols(3);
  model.tumour.triangles.resize(3, 1);
  model.tumour.triangles << 2, 1, 0;
  model.craniotomy = {4};
  model.brainstem = {0, 1};
  model.slaves = {2};
  model.fixed = {};
  model.gravity_direction = Vec3(0.6, 0, -0.8);
  model.fluid_plane_depth_mm = -12.25;
  model.slave_plane_depth_mm = 7.75;
  model.model_id = content_hash(model);
  return file;
}

class ModelFileTest : public testing::Test {
 protected:
  std::filesystem::path written() {
    const Status status = write_model(folder_ / "m.h5", example());
    EXPECT_TRUE(status) << status.error().message;
    return folder_ / "m.h5";
  }
  // Reads bytes as a model file, with nothing printed.
  Result<ModelFile> read_bytes(const std::string& bytes) {
    return read_model(folder_.write("changed.h5", bytes));
  }
  TemporaryFolder folder_;
};

TEST_F(ModelFileTest, ModelAndCaseAreReadBackBitForBit) {
  const ModelFile original = example();
  const auto read = read_model(written());
  ASSERT_TRUE(read) << read.error().message;
  const BrainModel& model = read->model;
  EXPECT_EQ(model.case_id, "example");
  EXPECT_EQ(model.model_id, original.model.model_id);
  EXPECT_EQ(model.mesh.nodes, original.model.mesh.nodes);
  EXPECT_EQ(model.mesh.tets, original.model.mesh.tets);
  EXPECT_EQ(model.mesh.labels, original.model.mesh.labels);
  EXPECT_EQ(model.boundary_triangles, original.model.boundary_triangles);
  EXPECT_EQ(model.skull.vertices, original.model.skull.vertices);
  EXPECT_EQ(model.skull.triangles, original.model.skull.triangles);
  EXPECT_EQ(model.tumour.vertices, original.model.tumour.vertices);
  EXPECT_EQ(model.tumour.triangles, original.model.tumour.triangles);
  EXPECT_EQ(model.craniotomy, original.model.craniotomy);
  EXPECT_EQ(model.brainstem, original.model.brainstem);
  EXPECT_EQ(model.slaves, original.model.slaves);
  EXPECT_EQ(model.fixed, original.model.fixed);
  EXPECT_EQ(model.gravity_direction, original.model.gravity_direction);
  EXPECT_EQ(model.fluid_plane_depth_mm, -12.25);
  EXPECT_EQ(model.slave_plane_depth_mm, 7.75);
  EXPECT_EQ(case_config_text(read->config), case_config_text(original.config));
  EXPECT_EQ(read->config.file, "/cases/example.yaml");
}

TEST_F(ModelFileTest, ModelWithoutLabelsOrSkullIsReadBack) {
  ModelFile file = example();
  file.model.mesh.labels.clear();
  file.model.skull = {};
  file.model.model_id = content_hash(file.model);
  ASSERT_TRUE(write_model(folder_ / "m.h5", file));
  const auto read = read_model(folder_ / "m.h5");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->model.skull.num_vertices(), 0);
}

TEST_F(ModelFileTest, OnlyTheFinalFileIsLeftAndAnOldOneIsReplaced) {
  folder_.write("m.h5", "an older file");
  EXPECT_TRUE(read_model(written()));
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(ModelFileTest, EveryFlippedBitIsRefused) {
  const auto path = written();
  const std::string intact = content_of(path);
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  const auto put_byte = [&file](std::size_t at, char byte) {
    file.seekp(static_cast<std::streamoff>(at)).put(byte).flush();
  };
  testing::internal::CaptureStderr();
  for (std::size_t at = 0; at < intact.size(); at += at < 120 ? 1 : 97) {
    put_byte(at, static_cast<char>(intact[at] ^ (1 << (at % 8))));
    const auto read = read_model(path);
    put_byte(at, intact[at]);
    ASSERT_FALSE(read) << "byte " << at;
    EXPECT_EQ(read.error().code, ErrorCode::kUnreadable);
    EXPECT_THAT(read.error().message, HasSubstr("m.h5: is "));
    EXPECT_EQ(read.error().message.find('\n'), std::string::npos);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "HDF5 stays silent";
  EXPECT_TRUE(read_model(path)) << "every byte was put back";
}

// The first block as the header of model_file.hpp describes it, made independently.
std::string with_header(const std::string& bytes) {
  const std::string body = bytes.substr(512);
  const auto crc =
      crc32(0L, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
  std::ostringstream header;
  header << "brainshift model file\nformat 1\nbytes " << bytes.size() << "\ncrc32 " << std::hex
         << std::setw(8) << std::setfill('0') << crc << "\n";
  std::string block = header.str();
  block.resize(512, '\0');
  return block + body;
}

TEST_F(ModelFileTest, HeaderIsAsDocumented) {
  const std::string bytes = content_of(written());
  EXPECT_EQ(with_header(bytes), bytes);
  EXPECT_EQ(bytes.substr(512, 4), "\x89HDF");
}

TEST_F(ModelFileTest, CoordinateAlteredBehindTheChecksumIsRefused) {
  std::string bytes = content_of(written());
  const double value = 0.1 * 7;
  const std::string stored(reinterpret_cast<const char*>(&value), sizeof value);
  const std::size_t at = bytes.find(stored);
  ASSERT_NE(at, std::string::npos);
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  const auto read = read_bytes(with_header(bytes));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("does not match its model_id"));
}

TEST_F(ModelFileTest, StoredCaseIsValidatedAgain) {
  std::string bytes = content_of(written());
  const std::size_t at = bytes.find("poisson_ratio: 0.4");
  ASSERT_NE(at, std::string::npos);
  bytes[at + 17] = '9';
  const auto read = read_bytes(with_header(bytes));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("material.poisson_ratio = 0.9"));
}

TEST_F(ModelFileTest, MissingDataSetIsNamed) {
  std::string bytes = content_of(written());
  const std::size_t at = bytes.find("boundary_triangles");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = 'B';
  const auto read = read_bytes(with_header(bytes));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("boundary_triangles is missing"));
}

TEST_F(ModelFileTest, HeaderWithoutHdf5IsRefused) {
  const auto read = read_bytes(with_header(std::string(2000, 'x')));
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("HDF5 cannot open it"));
}

TEST_F(ModelFileTest, OtherFormatIsNamed) {
  std::string bytes = content_of(written());
  bytes.replace(bytes.find("format 1"), 8, "format 2");
  const auto read = read_bytes(bytes);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("is a model file of 'format 2': must be 'format 1'"));
}

TEST_F(ModelFileTest, EveryTruncationIsRefused) {
  const std::string intact = content_of(written());
  for (std::size_t size = 0; size < intact.size(); size += 197) {
    const auto read = read_bytes(intact.substr(0, size));
    ASSERT_FALSE(read) << size;
    EXPECT_THAT(read.error().message,
                AnyOf(HasSubstr("not a model file"), HasSubstr("is a model file of"),
                      HasSubstr("truncated")));
  }
}

TEST_F(ModelFileTest, ForeignFileIsRefused) {
  for (const char* content : {"", "case_id: no model", "\x89HDF\r\n\x1a\n"}) {
    const auto read = read_bytes(content);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::kUnreadable);
    EXPECT_THAT(read.error().message, HasSubstr("changed.h5: is not a model file"));
  }
}

TEST_F(ModelFileTest, MissingFileIsNotFound) {
  const auto read = read_model(folder_ / "absent.h5");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::kNotFound);
}

TEST_F(ModelFileTest, UnwritablePlaceIsNamedAndLeavesNothing) {
  const Status status = write_model(folder_ / "no" / "m.h5", example());
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kWriteFailed);
  EXPECT_THAT(status.error().message, HasSubstr("no/m.h5"));
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(ModelFileTest, ModelWithAForeignIdIsNotWritten) {
  ModelFile file = example();
  file.model.mesh.nodes(0, 0) += 1.0;
  const Status status = write_model(folder_ / "m.h5", file);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(ModelFileTest, InvalidCaseIsNotWritten) {
  ModelFile file = example();
  file.config.material.poisson_ratio = 0.6;
  const Status status = write_model(folder_ / "m.h5", file);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, HasSubstr("material.poisson_ratio = 0.6"));
  EXPECT_EQ(folder_.entries(), 0u);
}

}  // namespace
}  // namespace brainshift::io
