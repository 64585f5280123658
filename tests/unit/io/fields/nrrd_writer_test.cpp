// SPDX-License-Identifier: GPL-3.0-or-later
// Read back line by line and by zlib. ITK, elastix and plastimatch read such files in
// cmake/scripts/interchange.sh.
#include "common/io/fields/nrrd_writer.hpp"

#include <gmock/gmock.h>
#include <zlib.h>

#include <cstdio>
#include <cstring>
#include <map>
#include <sstream>
#include <vector>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/io/fields/small_field.hpp"

namespace brainshift::io {
namespace {

using test_support::TemporaryFolder;
using testing::HasSubstr;

struct Nrrd {
  std::string magic;
  std::map<std::string, std::string> keys;  // fields and key/value pairs
  std::vector<float> values;
};

// gzread takes what follows the header for a gzip stream of its own.
Nrrd read_nrrd_field(const std::filesystem::path& path) {
  const std::string content = test_support::content_of(path);
  const std::size_t end = content.find("\n\n");
  Nrrd nrrd;
  std::istringstream header(content.substr(0, end));
  std::getline(header, nrrd.magic);
  for (std::string line; std::getline(header, line);) {
    if (line[0] == '#') continue;
    const std::size_t pair = line.find(":="), colon = line.find(": ");
    const bool is_pair = pair != std::string::npos && pair < colon;
    nrrd.keys[line.substr(0, is_pair ? pair : colon)] = line.substr((is_pair ? pair : colon) + 2);
  }
  std::string packed = content.substr(end + 2);
  std::string bytes(1 << 16, '\0');
  z_stream stream{};
  inflateInit2(&stream, 16 + MAX_WBITS);
  stream.next_in = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_out = static_cast<uInt>(bytes.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  nrrd.values.resize(stream.total_out / sizeof(float));
  std::memcpy(nrrd.values.data(), bytes.data(), stream.total_out);
  inflateEnd(&stream);
  return nrrd;
}

Vec3 vector_of(const std::string& text) {
  Vec3 v = Vec3::Zero();
  EXPECT_EQ(std::sscanf(text.c_str(), "(%lf,%lf,%lf)", &v[0], &v[1], &v[2]), 3) << text;
  return v;
}

TEST(NrrdWriter, SaysWhatTheFieldIs) {
  const TemporaryFolder folder;
  DisplacementField field = small_field();
  ASSERT_TRUE(write_nrrd(folder / "f.nrrd", field));
  auto nrrd = read_nrrd_field(folder / "f.nrrd");
  EXPECT_EQ(nrrd.magic, "NRRD0005");
  EXPECT_EQ(nrrd.keys["type"], "float");
  EXPECT_EQ(nrrd.keys["space"], "left-posterior-superior");
  EXPECT_EQ(nrrd.keys["sizes"], "3 5 4 3");
  EXPECT_EQ(nrrd.keys["kinds"], "vector domain domain domain");
  EXPECT_EQ(nrrd.keys["endian"], "little");
  EXPECT_EQ(nrrd.keys["intent_code"], "1006");
  EXPECT_EQ(nrrd.keys["displacement field type"], "resampling");
  EXPECT_EQ(nrrd.keys["brainshift note"], "update 7, good");
  field.direction = FieldDirection::kModeling;
  ASSERT_TRUE(write_nrrd(folder / "f.nrrd", field));
  EXPECT_EQ(read_nrrd_field(folder / "f.nrrd").keys["displacement field type"], "modeling");
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(NrrdWriter, PlacesAndVectorsAreLps) {
  const TemporaryFolder folder;
  const DisplacementField field = small_field();
  ASSERT_TRUE(write_nrrd(folder / "f.nrrd", field));
  auto nrrd = read_nrrd_field(folder / "f.nrrd");
  const Mat3 lps_ras = Vec3(-1, -1, 1).asDiagonal();
  EXPECT_EQ(vector_of(nrrd.keys["space origin"]),
            Vec3(lps_ras * field.grid.T_ras_voxel.translation()));
  std::istringstream directions(nrrd.keys["space directions"]);
  std::string word;
  directions >> word;
  EXPECT_EQ(word, "none");
  for (int axis = 0; axis < 3; ++axis) {
    directions >> word;
    EXPECT_EQ(vector_of(word), Vec3(lps_ras * field.grid.T_ras_voxel.linear().col(axis)));
  }
  ASSERT_EQ(nrrd.values.size(), field.ras_mm.size());
  for (std::size_t i = 0; i < nrrd.values.size(); ++i) {
    EXPECT_EQ(nrrd.values[i], i % 3 < 2 ? -field.ras_mm[i] : field.ras_mm[i]);
  }
}

TEST(NrrdWriter, WhatIsInvalidIsRefusedByNameAndNothingWritten) {
  const TemporaryFolder folder;
  DisplacementField field = small_field();
  EXPECT_THAT(write_nrrd(folder / "f.nhdr", field).error().message,
              HasSubstr("f.nhdr: must end in .nrrd"));
  EXPECT_EQ(write_nrrd(folder / "no" / "f.nrrd", field).error().code, ErrorCode::kWriteFailed);
  field.ras_mm.pop_back();
  EXPECT_THAT(write_nrrd(folder / "f.nrrd", field).error().message,
              HasSubstr("f.nrrd: volume has"));
  EXPECT_EQ(folder.entries(), 0u);
}

}  // namespace
}  // namespace brainshift::io
