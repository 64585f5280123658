// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model/model_file.hpp"

#include <gmock/gmock.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/model/model_file_example.hpp"

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/lsan_interface.h>
#endif

namespace brainshift::io {
namespace {

// HDF5 does not free what belongs to a file that it could not close.
#ifdef __SANITIZE_ADDRESS__
using LeaksOfHdf5 = __lsan::ScopedDisabler;
#else
struct LeaksOfHdf5 {};
#endif

using test_example::condensed_file;
using test_example::with_header;
using test_support::content_of;
using test_support::TemporaryFolder;

using testing::AnyOf;
using testing::HasSubstr;

class ModelFileTest : public testing::Test {
 protected:
  std::filesystem::path written() {
    const Status status = write_model(folder_ / "m.h5", condensed_file());
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
  const ModelFile original = test_example::model_file();
  const auto read = value_or_fail(read_model(written()));
  const BrainModel& model = read.model;
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
  EXPECT_EQ(model.tumour_distance.values, original.model.tumour_distance.values);
  EXPECT_EQ(model.tumour_distance.dims, (std::array<int, 3>{2, 3, 4}));
  EXPECT_EQ(model.tumour_distance.origin_mm, Vec3(-1.5, 2.25, 3.125));
  EXPECT_EQ(model.tumour_distance.spacing_mm, 0.75);
  EXPECT_EQ(model.craniotomy, original.model.craniotomy);
  EXPECT_EQ(model.brainstem, original.model.brainstem);
  EXPECT_EQ(model.slaves, original.model.slaves);
  EXPECT_EQ(model.fixed, original.model.fixed);
  EXPECT_EQ(model.gravity_direction, original.model.gravity_direction);
  EXPECT_EQ(model.fluid_plane_depth_mm, -12.25);
  EXPECT_EQ(model.slave_plane_depth_mm, 7.75);
  EXPECT_EQ(case_config_text(read.config), case_config_text(original.config));
  EXPECT_EQ(read.config.file, "/cases/example.yaml");
}

TEST_F(ModelFileTest, ModelWithoutLabelsOrSkullIsReadBack) {
  ModelFile file = test_example::model_file();
  file.model.mesh.labels.clear();
  file.model.skull = {};
  file.model.model_id = content_hash(file.model);
  ASSERT_TRUE(write_model(folder_ / "m.h5", file));
  const auto read = value_or_fail(read_model(folder_ / "m.h5"));
  EXPECT_EQ(read.model.skull.num_vertices(), 0);
}

TEST_F(ModelFileTest, DistanceGridMayBeMissingAndMustFit) {
  ModelFile file = test_example::model_file();
  file.model.tumour_distance = {};
  ASSERT_TRUE(write_model(folder_ / "m.h5", file));
  const auto read = value_or_fail(read_model(folder_ / "m.h5"));
  EXPECT_TRUE(read.model.tumour_distance.empty());

  file = test_example::model_file();
  file.model.tumour_distance.values.pop_back();
  EXPECT_THAT(refusal_of(write_model(folder_ / "n.h5", file), ErrorCode::kInvalidArgument),
              HasSubstr("23 values for 2 x 3 x 4 nodes"));
}

TEST_F(ModelFileTest, DistanceGridAlteredBehindTheChecksumIsRefused) {
  std::string bytes = content_of(written());
  const std::vector<float> stored = test_example::model_file().model.tumour_distance.values;
  const std::size_t at =
      bytes.find(std::string(reinterpret_cast<const char*>(stored.data()), 4 * stored.size()));
  ASSERT_NE(at, std::string::npos);
  for (int byte = 0; byte < 4; ++byte) bytes[at + 20 + static_cast<std::size_t>(byte)] = '\xff';
  EXPECT_THAT(sentence_of(read_bytes(with_header(bytes))),
              HasSubstr("tumour_distance: distance grid: value 5 is not"));
}

TEST_F(ModelFileTest, OnlyTheFinalFileIsLeftAndAnOldOneIsReplaced) {
  folder_.write("m.h5", "an older file");
  EXPECT_TRUE(read_model(written()));
  EXPECT_EQ(folder_.entries(), 1u);
}

TEST_F(ModelFileTest, WhatWouldBeReplacedIsAModelOrRefused) {
  EXPECT_FALSE(value_or_fail(model_to_replace(folder_ / "absent.h5")));
  const auto old = value_or_fail(model_to_replace(written()));
  ASSERT_TRUE(old);
  EXPECT_EQ(old->case_id, condensed_file().model.case_id);
  EXPECT_EQ(old->model_id, condensed_file().model.model_id);
  EXPECT_EQ(old->unreadable, "");
  std::string altered = content_of(written());
  altered[altered.size() / 2] = static_cast<char>(altered[altered.size() / 2] ^ 1);
  EXPECT_THAT(value_or_fail(model_to_replace(folder_.write("a.h5", altered)))->unreadable,
              HasSubstr("a.h5: is altered or damaged"));
  for (const char* content : {"", "my notes", "brainshift model", "\x89HDF\r\n\x1a\n"}) {
    EXPECT_THAT(
        refusal_of(model_to_replace(folder_.write("n.h5", content)), ErrorCode::kInvalidArgument),
        HasSubstr("n.h5: is there and is no model file: it is not replaced"));
  }
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
    EXPECT_THAT(refusal_of(read, ErrorCode::kUnreadable),
                testing::AllOf(HasSubstr("m.h5: is "), testing::Not(testing::HasSubstr("\n"))))
        << "byte " << at;
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "HDF5 stays silent";
  EXPECT_TRUE(read_model(path)) << "every byte was put back";
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
  EXPECT_THAT(sentence_of(read_bytes(with_header(bytes))),
              HasSubstr("does not match its model_id"));
}

TEST_F(ModelFileTest, StoredCaseIsValidatedAgain) {
  std::string bytes = content_of(written());
  const std::size_t at = bytes.find("poisson_ratio: 0.4");
  ASSERT_NE(at, std::string::npos);
  bytes[at + 17] = '9';
  EXPECT_THAT(sentence_of(read_bytes(with_header(bytes))),
              HasSubstr("material.poisson_ratio = 0.9"));
}

TEST_F(ModelFileTest, MissingDataSetIsNamed) {
  std::string bytes = content_of(written());
  const std::size_t at = bytes.find("boundary_triangles");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = 'B';
  EXPECT_THAT(sentence_of(read_bytes(with_header(bytes))),
              HasSubstr("boundary_triangles is missing"));
}

TEST_F(ModelFileTest, HeaderWithoutHdf5IsRefused) {
  EXPECT_THAT(sentence_of(read_bytes(with_header(std::string(2000, 'x')))),
              HasSubstr("HDF5 cannot open it"));
}

TEST_F(ModelFileTest, OtherFormatIsNamedWithTheWayOut) {
  std::string bytes = content_of(written());
  bytes.replace(bytes.find("format 7"), 8, "format 6");
  EXPECT_THAT(
      sentence_of(read_bytes(bytes)),
      HasSubstr("is a model file of 'format 6': must be 'format 7', run brainshiftd prepare "
                "again"));
}

TEST_F(ModelFileTest, EveryTruncationIsRefused) {
  const std::string intact = content_of(written());
  for (std::size_t size = 0; size < intact.size(); size += 197) {
    EXPECT_THAT(sentence_of(read_bytes(intact.substr(0, size))),
                AnyOf(HasSubstr("not a model file"), HasSubstr("is a model file of"),
                      HasSubstr("damaged in its first block"), HasSubstr("truncated")))
        << size;
  }
}

TEST_F(ModelFileTest, TruncatedAlteredAndLengthenedAreToldApart) {
  const std::string intact = content_of(written());
  EXPECT_THAT(read_bytes(intact.substr(0, 1000)).error().message,
              HasSubstr("is truncated or was added to: has 1000 bytes, was written with " +
                        std::to_string(intact.size())));
  EXPECT_THAT(read_bytes(intact + "x").error().message, HasSubstr("was added to"));
  std::string altered = intact;
  altered[intact.size() / 2] = static_cast<char>(altered[intact.size() / 2] ^ 1);
  EXPECT_THAT(read_bytes(altered).error().message,
              HasSubstr("is altered or damaged: its checksum"));
}

TEST_F(ModelFileTest, ForeignFileIsRefused) {
  for (const char* content : {"", "case_id: no model", "\x89HDF\r\n\x1a\n"}) {
    EXPECT_THAT(refusal_of(read_bytes(content), ErrorCode::kUnreadable),
                HasSubstr("changed.h5: is not a model file"));
  }
}

TEST_F(ModelFileTest, MissingFileIsNotFound) {
  refusal_of(read_model(folder_ / "absent.h5"), ErrorCode::kNotFound);
}

TEST_F(ModelFileTest, UnwritablePlaceIsNamedAndLeavesNothing) {
  EXPECT_THAT(refusal_of(write_model(folder_ / "no" / "m.h5", test_example::model_file()),
                         ErrorCode::kWriteFailed),
              HasSubstr("no/m.h5"));
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(ModelFileTest, ModelWithAForeignIdIsNotWritten) {
  ModelFile file = test_example::model_file();
  file.model.mesh.nodes(0, 0) += 1.0;
  refusal_of(write_model(folder_ / "m.h5", file), ErrorCode::kInvalidArgument);
  EXPECT_EQ(folder_.entries(), 0u);
}

TEST_F(ModelFileTest, InvalidCaseIsNotWritten) {
  ModelFile file = test_example::model_file();
  file.config.material.poisson_ratio = 0.6;
  EXPECT_THAT(sentence_of(write_model(folder_ / "m.h5", file)),
              HasSubstr("material.poisson_ratio = 0.6"));
  EXPECT_EQ(folder_.entries(), 0u);
}

// A file-size limit fails like a full disk: some write in the middle comes back short.
TEST_F(ModelFileTest, FullDiskLeavesTheOldFileAlone) {
  H5garbage_collect();  // what it keeps of earlier files may be what it loses here
  [[maybe_unused]] const LeaksOfHdf5 expected;
  const std::string before = content_of(written());
  ASSERT_GT(before.size(), 4000u);
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  for (const rlim_t limit : {rlim_t{100}, rlim_t{1000}, rlim_t{3000}, rlim_t{before.size() - 1}}) {
    const rlimit small{limit, old.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    const Status status = write_model(folder_ / "m.h5", condensed_file());
    setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_THAT(refusal_of(status, ErrorCode::kWriteFailed), HasSubstr("m.h5: cannot write "))
        << limit;
    EXPECT_EQ(folder_.entries(), 1u);
    EXPECT_EQ(content_of(folder_ / "m.h5"), before);
  }
  std::signal(SIGXFSZ, SIG_DFL);
  EXPECT_TRUE(write_model(folder_ / "m.h5", condensed_file())) << "HDF5 is still usable";
}

// The other process replaces the file all the time; HDF5 itself allows one call at a time in a
// process.
// A reader tries 20 times. Each failure takes a replacement, so that 19 of them never exhaust it,
// however slow it is.
TEST_F(ModelFileTest, ReaderNeverSeesAHalfWrittenModel) {
  const auto path = written();
  int reads = 0;
  for (int round = 0; round < 2; ++round) {
    const pid_t writer = fork();
    ASSERT_GE(writer, 0);
    if (writer == 0) {
      bool good = true;
      for (int i = 0; i < 19; ++i) {
        good =
            good && write_model(path, i % 2 == 0 ? test_example::model_file() : condensed_file());
      }
      _exit(good ? 0 : 1);
    }
    int state = 0;
    while (waitpid(writer, &state, WNOHANG) == 0) {
      const auto read = value_or_fail(read_model(path));
      EXPECT_TRUE(read.condensed.empty() || read.condensed.size() == 2u);
      ++reads;
    }
    EXPECT_EQ(state, 0);
  }
  EXPECT_GT(reads, 0);
}

}  // namespace
}  // namespace brainshift::io
