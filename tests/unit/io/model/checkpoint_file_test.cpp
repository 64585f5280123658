// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/model/checkpoint_file.hpp"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>
#include <thread>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::content_of;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::uint64_t kKey = 0x1122334455667788u;
constexpr std::size_t kFileHeader = 24, kBlockHeader = 40;

// Different numbers for each index.
template <typename Scalar>
Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> block(int index, int rows, int columns) {
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> values(rows, columns);
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    values.data()[i] = static_cast<Scalar>(1000 * index + static_cast<int>(i)) / 3;
  }
  return values;
}

class CheckpointFileTest : public testing::Test {
 protected:
  CheckpointFile open(std::uint64_t key = kKey) { return open(path_, key); }
  static CheckpointFile open(const std::filesystem::path& path, std::uint64_t key = kKey) {
    auto file = CheckpointFile::open_or_create(path, key);
    if (!file) throw std::runtime_error(file.error().message);
    return std::move(*file);
  }
  // A float, a double and a float block; the sizes of the file behind each.
  std::vector<std::size_t> write_three() {
    CheckpointFile file = open();
    std::vector<std::size_t> ends;
    const auto note = [&](const Status& status) {
      EXPECT_TRUE(status) << status.error().message;
      ends.push_back(std::filesystem::file_size(path_));
    };
    note(file.append(4, block<float>(4, 6, 2)));
    note(file.append(0, block<double>(0, 5, 3)));
    note(file.append(7, block<float>(7, 6, 1)));
    return ends;
  }
  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "condense.checkpoint";
};

// The indices that write_three() has in a file of that size.
std::vector<int> whole_at(std::size_t size, const std::vector<std::size_t>& ends) {
  if (size < ends[0]) return {};
  if (size < ends[1]) return {4};
  if (size < ends[2]) return {0, 4};
  return {0, 4, 7};
}

void expect_readable(const CheckpointFile& file, const std::vector<int>& indices) {
  for (const int index : indices) {
    if (index == 0) {
      Eigen::MatrixXd out(5, 3);
      ASSERT_TRUE(file.read(0, Eigen::Ref<Eigen::MatrixXd>(out)));
      EXPECT_EQ(out, block<double>(0, 5, 3));
    } else {
      Eigen::MatrixXf out(6, index == 4 ? 2 : 1);
      ASSERT_TRUE(file.read(index, Eigen::Ref<Eigen::MatrixXf>(out)));
      EXPECT_EQ(out, block<float>(index, 6, static_cast<int>(out.cols())));
    }
  }
}

TEST_F(CheckpointFileTest, BlocksAreReadBackBitForBit) {
  write_three();
  const CheckpointFile file = open();
  EXPECT_THAT(file.blocks(), ElementsAre(0, 4, 7));
  EXPECT_TRUE(file.has(4));
  EXPECT_FALSE(file.has(1));
  expect_readable(file, file.blocks());
}

TEST_F(CheckpointFileTest, ColumnsOfALargerMatrixAreWrittenAndRead) {
  const Eigen::MatrixXf large = block<float>(1, 8, 5);
  Eigen::MatrixXf read = Eigen::MatrixXf::Zero(8, 5);
  CheckpointFile file = open();
  // Rows in the middle, so that columns do not touch one another in memory.
  ASSERT_TRUE(file.append(0, large.block(2, 1, 4, 3)));
  ASSERT_TRUE(file.read(0, read.block(2, 1, 4, 3)));
  EXPECT_EQ(read.block(2, 1, 4, 3), large.block(2, 1, 4, 3));
  EXPECT_EQ(read.norm(), large.block(2, 1, 4, 3).norm()) << "nothing else was touched";
}

TEST_F(CheckpointFileTest, EveryTruncationResumesWithExactlyTheWholeBlocks) {
  const auto ends = write_three();
  const std::string intact = content_of(path_);
  ASSERT_EQ(intact.size(), ends[2]);
  ASSERT_EQ(ends[0], kFileHeader + kBlockHeader + 6 * 2 * 4);
  for (std::size_t size = 0; size <= intact.size(); ++size) {
    // A new name each time: rewriting a file makes the file system wait for the disk.
    const auto path = folder_.write(std::to_string(size), intact.substr(0, size));
    {
      CheckpointFile file = open(path);
      ASSERT_THAT(file.blocks(), ElementsAreArray(whole_at(size, ends))) << size;
      expect_readable(file, file.blocks());
      ASSERT_TRUE(file.append(9, block<float>(9, 6, 1))) << "goes on behind the last whole block";
    }
    auto expected = whole_at(size, ends);
    expected.push_back(9);
    ASSERT_THAT(open(path).blocks(), ElementsAreArray(expected)) << size;
  }
}

TEST_F(CheckpointFileTest, EveryFlippedBitDropsItsBlockAndWhatFollows) {
  const auto ends = write_three();
  const std::string intact = content_of(path_);
  for (std::size_t at = 8; at < intact.size(); ++at) {
    std::string changed = intact;
    changed[at] = static_cast<char>(changed[at] ^ (1 << (at % 8)));
    const CheckpointFile file = open(folder_.write(std::to_string(at), changed));
    // The block that begins before and ends behind the byte is the first one not whole.
    const auto expected = at < kFileHeader ? std::vector<int>{} : whole_at(at, ends);
    ASSERT_THAT(file.blocks(), ElementsAreArray(expected)) << at;
    expect_readable(file, file.blocks());
  }
}

TEST_F(CheckpointFileTest, GarbageBehindTheLastBlockIsDropped) {
  const auto ends = write_three();
  folder_.write("condense.checkpoint", content_of(path_) + std::string(100, '\xff'));
  EXPECT_THAT(open().blocks(), ElementsAre(0, 4, 7));
  EXPECT_EQ(std::filesystem::file_size(path_), ends[2]);
}

TEST_F(CheckpointFileTest, OtherKeyStartsAfresh) {
  write_three();
  EXPECT_THAT(open(kKey + 1).blocks(), IsEmpty());
  EXPECT_THAT(open(kKey).blocks(), IsEmpty()) << "the first key's blocks are gone";
}

TEST_F(CheckpointFileTest, ForeignFileIsLeftAlone) {
  for (const char* content : {"case_id: example\n", "x", "bshiftcX and more than a header of it"}) {
    folder_.write("condense.checkpoint", content);
    EXPECT_THAT(refusal_of(CheckpointFile::open_or_create(path_, kKey), ErrorCode::kUnreadable),
                HasSubstr("condense.checkpoint: is there but is no checkp"))
        << content;
    EXPECT_EQ(content_of(path_), content);
  }
}

TEST_F(CheckpointFileTest, OneProcessAtATime) {
  {
    const CheckpointFile first = open();
    refusal_of(CheckpointFile::open_or_create(path_, kKey), ErrorCode::kUnavailable);
  }
  EXPECT_TRUE(CheckpointFile::open_or_create(path_, kKey));
}

TEST_F(CheckpointFileTest, UnwritablePlaceIsNamed) {
  EXPECT_THAT(refusal_of(CheckpointFile::open_or_create(folder_ / "no" / "c", kKey),
                         ErrorCode::kWriteFailed),
              HasSubstr("no/c: cannot open: No such file"));
  EXPECT_FALSE(CheckpointFile::open_or_create(folder_.path(), kKey));
}

TEST_F(CheckpointFileTest, BlockIsAppendedOnce) {
  CheckpointFile file = open();
  ASSERT_TRUE(file.append(1, block<float>(1, 3, 2)));
  EXPECT_THAT(refusal_of(file.append(1, block<float>(2, 3, 2)), ErrorCode::kInvalidArgument),
              HasSubstr("has block 1 already"));
}

TEST_F(CheckpointFileTest, WhatIsNotThereIsNotRead) {
  CheckpointFile file = open();
  ASSERT_TRUE(file.append(1, block<float>(1, 3, 2)));
  Eigen::MatrixXf other_shape(2, 3), right(3, 2);
  Eigen::MatrixXd other_scalar(3, 2);
  EXPECT_EQ(file.read(2, Eigen::Ref<Eigen::MatrixXf>(right)).error().code, ErrorCode::kNotFound);
  const Status shape = file.read(1, Eigen::Ref<Eigen::MatrixXf>(other_shape));
  EXPECT_EQ(shape.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(shape.error().message,
              HasSubstr("block 1 is 3 x 2 numbers of 4 bytes, asked for 2 x 3 of 4"));
  EXPECT_EQ(file.read(1, Eigen::Ref<Eigen::MatrixXd>(other_scalar)).error().code,
            ErrorCode::kInvalidArgument);
}

TEST_F(CheckpointFileTest, ColumnsOfABlockAreReadByThemselves) {
  CheckpointFile file = open();
  const Eigen::MatrixXf whole = block<float>(3, 4, 6);
  ASSERT_TRUE(file.append(3, whole));
  ASSERT_TRUE(file.append(4, block<double>(4, 4, 6)));
  for (const auto& [first, count] :
       {std::pair{0, 6}, std::pair{0, 1}, std::pair{2, 3}, std::pair{5, 1}, std::pair{6, 0}}) {
    Eigen::MatrixXf out(4, count);
    ASSERT_TRUE(file.read_columns(3, first, out)) << first;
    EXPECT_EQ(out, whole.middleCols(first, count));
  }
  Eigen::MatrixXf two(4, 2), short_rows(3, 2);
  EXPECT_EQ(file.read_columns(3, 5, two).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(file.read_columns(3, 0, short_rows).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(file.read_columns(4, 0, two).error().code, ErrorCode::kInvalidArgument) << "doubles";
  EXPECT_EQ(file.read_columns(9, 0, two).error().code, ErrorCode::kNotFound);
  std::filesystem::resize_file(path_, kFileHeader + kBlockHeader + 4);
  EXPECT_EQ(file.read_columns(3, 0, two).error().code, ErrorCode::kUnreadable);
}

TEST_F(CheckpointFileTest, BlockAlteredWhileOpenIsNotRead) {
  const auto ends = write_three();
  const CheckpointFile file = open();
  std::fstream bytes(path_, std::ios::binary | std::ios::in | std::ios::out);
  bytes.seekp(static_cast<std::streamoff>(ends[0] - 1)).put('\x7f').flush();
  Eigen::MatrixXf out(6, 2);
  EXPECT_EQ(file.read(4, Eigen::Ref<Eigen::MatrixXf>(out)).error().code, ErrorCode::kUnreadable);
}

// A file-size limit fails like a full disk.
TEST_F(CheckpointFileTest, FullDiskKeepsTheBlocksThatWereThere) {
  const auto ends = write_three();
  CheckpointFile file = open();
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  const rlimit small{ends[2] + kBlockHeader + 10, old.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  const Status status = file.append(8, block<float>(8, 6, 2));
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, SIG_DFL);
  refusal_of(status, ErrorCode::kWriteFailed);
  EXPECT_EQ(std::filesystem::file_size(path_), ends[2]);
  EXPECT_TRUE(file.append(8, block<float>(8, 6, 2))) << "when there is room again";
  EXPECT_THAT(file.blocks(), ElementsAre(0, 4, 7, 8));
}

TEST_F(CheckpointFileTest, SeveralThreadsAppend) {
  {
    CheckpointFile file = open();
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([&file, t] {
        for (int i = t; i < 40; i += 4) EXPECT_TRUE(file.append(i, block<float>(i, 6, 3)));
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
  const CheckpointFile file = open();
  ASSERT_EQ(file.blocks().size(), 40u);
  for (int i = 0; i < 40; ++i) {
    Eigen::MatrixXf out(6, 3);
    ASSERT_TRUE(file.read(i, Eigen::Ref<Eigen::MatrixXf>(out)));
    EXPECT_EQ(out, block<float>(i, 6, 3));
  }
}

TEST_F(CheckpointFileTest, RemovedFileIsGone) {
  write_three();
  CheckpointFile file = open();
  EXPECT_TRUE(file.remove());
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_THAT(file.blocks(), IsEmpty());
  EXPECT_FALSE(file.append(1, block<float>(1, 3, 2)));
}

}  // namespace
}  // namespace brainshift::io
