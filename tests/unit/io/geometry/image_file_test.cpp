// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/geometry/image_file.hpp"

#include <gmock/gmock.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

using test_support::put;
using test_support::TemporaryFolder;

using testing::ElementsAre;
using testing::HasSubstr;

// Datatype codes of nifti1.h, written out: the test is an independent reading of the standard.
enum Code : std::int16_t {
  kUint8 = 2,
  kInt16 = 4,
  kInt32 = 8,
  kFloat32 = 16,
  kComplex64 = 32,
  kFloat64 = 64,
  kRgb = 128,
  kInt8 = 256,
  kUint16 = 512,
  kUint32 = 768,
  kInt64 = 1024,
  kUint64 = 1280
};

// A NIfTI-1 header by field, at the byte offsets of the standard.
class Header {
 public:
  Header() : bytes_(352, '\0') {
    set<std::int32_t>(0, 348);
    dims({3, 2, 3, 4});
    type(kFloat32, 32);
    for (std::size_t i = 0; i < 8; ++i) set<float>(76 + 4 * i, 1.0f);  // pixdim
    set<float>(108, 352.0f);                                           // vox_offset
    set<float>(112, 0.0f);                                             // scl_slope
    bytes_[123] = 2;                                                   // mm
    sform({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    std::memcpy(&bytes_[344], "n+1", 4);
  }
  Header& dims(std::array<std::int16_t, 8> values) {
    for (std::size_t i = 0; i < 8; ++i) set<std::int16_t>(40 + 2 * i, values[i]);
    return *this;
  }
  Header& type(std::int16_t code, std::int16_t bits) {
    set<std::int16_t>(70, code);
    return set<std::int16_t>(72, bits);
  }
  Header& sform(std::array<float, 12> rows, std::int16_t code = 1) {
    set<std::int16_t>(254, code);
    for (std::size_t i = 0; i < 12; ++i) set<float>(280 + 4 * i, rows[i]);
    for (std::size_t i = 0; i < 3 && code > 0; ++i) {
      set<float>(80 + 4 * i, std::hypot(rows[i], rows[i + 4], rows[i + 8]));  // pixdim
    }
    return *this;
  }
  Header& qform(std::array<float, 3> quaternion, std::array<float, 3> offset,
                std::array<float, 4> pixdim) {
    set<std::int16_t>(252, 1);
    for (std::size_t i = 0; i < 3; ++i) set<float>(256 + 4 * i, quaternion[i]);
    for (std::size_t i = 0; i < 3; ++i) set<float>(268 + 4 * i, offset[i]);
    for (std::size_t i = 0; i < 4; ++i) set<float>(76 + 4 * i, pixdim[i]);
    return *this;
  }
  Header& no_sform() { return sform({}, 0); }
  Header& scaling(float slope, float intercept) {
    set<float>(112, slope);
    return set<float>(116, intercept);
  }
  template <typename T>
  Header& set(std::size_t offset, T value) {
    std::memcpy(&bytes_[offset], &value, sizeof(T));
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

// Voxel n has the value n + 1.
template <typename T>
std::string voxels(int count) {
  std::string out;
  for (int n = 0; n < count; ++n) put<T>(out, static_cast<T>(n + 1));
  return out;
}

std::string gzipped(const std::string& bytes) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&stream, bytes.size()) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

class ImageFile : public testing::Test {
 protected:
  Result<VoxelImage> read(const Header& header, const std::string& data,
                          const std::string& name = "i.nii") {
    return read_nifti(folder_.write(name, header.bytes() + data));
  }
  // The single line that a refused image gives; "" and a failure if it is accepted.
  std::string refusal(const Header& header, const std::string& data = voxels<float>(24)) {
    testing::internal::CaptureStderr();
    const auto image = read(header, data);
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "the library stays silent";
    const std::string sentence = refusal_of(image);
    EXPECT_THAT(sentence,
                testing::AllOf(HasSubstr("i.nii: "), testing::Not(testing::HasSubstr("\n"))));
    return sentence;
  }
  TemporaryFolder folder_;
};

TEST_F(ImageFile, VoxelsAreInFileOrderWithTheFirstIndexFastest) {
  const auto image = value_or_fail(read(Header(), voxels<float>(24)));
  EXPECT_THAT(image.dims, ElementsAre(2, 3, 4));
  ASSERT_EQ(image.values.size(), 24u);
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 2; ++i) {
        EXPECT_EQ(image.at(i, j, k), static_cast<float>(1 + i + 2 * j + 6 * k));
      }
    }
  }
}

TEST_F(ImageFile, ObliqueSformIsTakenAsItIs) {
  // Rotation by 30 degrees about x, voxels 1 x 2 x 3 mm, shifted.
  const float c = std::cos(0.5235988f);
  const float s = std::sin(0.5235988f);
  const Header header =
      Header().sform({1, 0, 0, -10, 0, 2 * c, -3 * s, -20, 0, 2 * s, 3 * c, 5.5f});
  const auto image = value_or_fail(read(header, voxels<float>(24)));
  const Vec3 place = image.T_ras_voxel * Vec3(1, 2, 3);
  EXPECT_NEAR(place.x(), -9.0, 1e-6);
  EXPECT_NEAR(place.y(), -20.0 + 2 * 2 * c - 3 * 3 * s, 1e-5);
  EXPECT_NEAR(place.z(), 5.5 + 2 * 2 * s + 3 * 3 * c, 1e-5);
}

TEST_F(ImageFile, SformHasPrecedenceOverQform) {
  const Header header = Header()
                            .qform({0, 0, 0}, {100, 100, 100}, {1, 1, 1, 1})
                            .sform({1, 0, 0, 7, 0, 1, 0, 8, 0, 0, 1, 9}, 2);
  const auto image = value_or_fail(read(header, voxels<float>(24)));
  EXPECT_TRUE(image.T_ras_voxel.translation().isApprox(Vec3(7, 8, 9)));
}

TEST_F(ImageFile, AHeaderThatContradictsItselfIsRefused) {
  const std::array<float, 12> unit = {1, 0, 0, 7, 0, 1, 0, 8, 0, 0, 1, 9};
  EXPECT_THAT(refusal(Header().sform(unit).set<float>(84, 2.0F), voxels<float>(24)),
              testing::AllOf(HasSubstr("sform has steps of 1 x 1 x 1 mm"),
                             HasSubstr("pixdim of 1 x 2 x 1")));
  EXPECT_TRUE(read(Header().sform(unit).set<float>(84, 1.005F), voxels<float>(24)));
  const auto both = [&](float x) {
    return Header().qform({0, 0, 0}, {x, 8, 9}, {1, 1, 1, 1}).sform(unit);
  };
  EXPECT_TRUE(read(both(7.3F), voxels<float>(24)));
  EXPECT_THAT(refusal(both(10), voxels<float>(24)),
              HasSubstr("both of the scanner's space (code 1), put a voxel 3 mm apart"));
}

TEST_F(ImageFile, GzipUnderAnotherNameIsNamed) {
  const std::string gzip("\x1F\x8B\x08\0\0\0\0\0\0\0", 10);
  EXPECT_THAT(refusal_of(read_nifti(folder_.write("a.nii", gzip + std::string(500, 'x')))),
              HasSubstr("compressed by gzip: its name must end in .nii.gz"));
}

TEST_F(ImageFile, QformAloneGivesTheRotationOfItsQuaternion) {
  // 90 degrees about z: quaternion (cos 45, 0, 0, sin 45). Voxel axis i goes to +y, j to -x.
  const Header header = Header().no_sform().qform({0, 0, std::sqrt(0.5f)}, {1, 2, 3}, {1, 2, 3, 4});
  const auto image = value_or_fail(read(header, voxels<float>(24)));
  EXPECT_LT((image.T_ras_voxel * Vec3(1, 0, 0) - Vec3(1, 4, 3)).norm(), 1e-5);
  EXPECT_LT((image.T_ras_voxel * Vec3(0, 1, 0) - Vec3(-2, 2, 3)).norm(), 1e-5);
  EXPECT_LT((image.T_ras_voxel * Vec3(0, 0, 1) - Vec3(1, 2, 7)).norm(), 1e-5);
}

TEST_F(ImageFile, LeftHandedQformFlipsTheThirdAxis) {
  const Header header = Header().no_sform().qform({0, 0, 0}, {0, 0, 0}, {-1, 1, 1, 2});
  const auto image = value_or_fail(read(header, voxels<float>(24)));
  EXPECT_LT((image.T_ras_voxel * Vec3(0, 0, 1) - Vec3(0, 0, -2)).norm(), 1e-6);
  EXPECT_LT(image.T_ras_voxel.linear().determinant(), 0.0);
}

TEST_F(ImageFile, LeftHandedSformIsKept) {
  const auto image = value_or_fail(
      read(Header().sform({-2, 0, 0, 90, 0, 1, 0, -125, 0, 0, 1, -71}), voxels<float>(24)));
  EXPECT_LT((image.T_ras_voxel * Vec3(10, 0, 0) - Vec3(70, -125, -71)).norm(), 1e-6);
}

TEST_F(ImageFile, SlopeAndInterceptScaleTheValues) {
  const auto image =
      value_or_fail(read(Header().type(kInt16, 16).scaling(0.5f, -3.0f), voxels<std::int16_t>(24)));
  EXPECT_FLOAT_EQ(image.values[0], 0.5f * 1 - 3);
  EXPECT_FLOAT_EQ(image.values[23], 0.5f * 24 - 3);
}

TEST_F(ImageFile, SlopeZeroMeansNoScaling) {
  const auto image = value_or_fail(
      read(Header().type(kInt16, 16).scaling(0.0f, 100.0f), voxels<std::int16_t>(24)));
  EXPECT_FLOAT_EQ(image.values[0], 1.0f);
}

struct TypeCase {
  const char* name;
  std::int16_t code;
  std::int16_t bits;
  std::string (*data)(int);
};

class ImageType : public ImageFile, public testing::WithParamInterface<TypeCase> {};

TEST_P(ImageType, IsReadPlainAndGzipped) {
  const TypeCase& type = GetParam();
  const Header header = Header().type(type.code, type.bits);
  const std::string plain = header.bytes() + type.data(24);
  for (const auto& path :
       {folder_.write("a.nii", plain), folder_.write("a.nii.gz", gzipped(plain))}) {
    const auto image = value_or_fail(read_nifti(path));
    for (int n = 0; n < 24; ++n) {
      EXPECT_EQ(image.values[static_cast<std::size_t>(n)], static_cast<float>(n + 1)) << path;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ImageType,
                         testing::Values(TypeCase{"uint8", kUint8, 8, voxels<std::uint8_t>},
                                         TypeCase{"int8", kInt8, 8, voxels<std::int8_t>},
                                         TypeCase{"uint16", kUint16, 16, voxels<std::uint16_t>},
                                         TypeCase{"int16", kInt16, 16, voxels<std::int16_t>},
                                         TypeCase{"uint32", kUint32, 32, voxels<std::uint32_t>},
                                         TypeCase{"int32", kInt32, 32, voxels<std::int32_t>},
                                         TypeCase{"uint64", kUint64, 64, voxels<std::uint64_t>},
                                         TypeCase{"int64", kInt64, 64, voxels<std::int64_t>},
                                         TypeCase{"float32", kFloat32, 32, voxels<float>},
                                         TypeCase{"float64", kFloat64, 64, voxels<double>}),
                         [](const auto& param) { return param.param.name; });

TEST_F(ImageFile, ExtremeIntegersKeepTheirSign) {
  std::string data;
  for (int n = 0; n < 24; ++n) put<std::int16_t>(data, n == 0 ? -32768 : 32767);
  const auto image = value_or_fail(read(Header().type(kInt16, 16), data));
  EXPECT_EQ(image.values[0], -32768.0f);
  EXPECT_EQ(image.values[1], 32767.0f);
}

TEST_F(ImageFile, OtherByteOrderGivesTheSameImage) {
  // Header fields that matter, byte-swapped by hand.
  const Header native = Header().type(kInt16, 16);
  std::string bytes = native.bytes();
  const auto swap = [&bytes](std::size_t offset, std::size_t size, std::size_t count) {
    for (std::size_t n = 0; n < count; ++n) {
      std::reverse(&bytes[offset + n * size], &bytes[offset + n * size] + size);
    }
  };
  swap(0, 4, 1);     // sizeof_hdr
  swap(40, 2, 8);    // dim
  swap(70, 2, 2);    // datatype, bitpix
  swap(76, 4, 8);    // pixdim
  swap(108, 4, 3);   // vox_offset, slope, intercept
  swap(252, 2, 2);   // form codes
  swap(256, 4, 18);  // quaternion and sform
  std::string data = voxels<std::int16_t>(24);
  for (std::size_t n = 0; n < 24; ++n) std::swap(data[2 * n], data[2 * n + 1]);
  const auto image = value_or_fail(read_nifti(folder_.write("big.nii", bytes + data)));
  EXPECT_EQ(image.values[23], 24.0f);
}

TEST_F(ImageFile, HeaderAndVoxelsInTwoFiles) {
  Header header;
  header.set<float>(108, 0.0f);
  std::string bytes = header.bytes();
  std::memcpy(&bytes[344], "ni1", 4);
  folder_.write("pair.hdr", bytes);
  folder_.write("pair.img", voxels<float>(24));
  const auto image = value_or_fail(read_nifti(folder_ / "pair.hdr"));
  EXPECT_EQ(image.values[23], 24.0f);
}

TEST_F(ImageFile, Nifti2IsRead) {
  // NIfTI-2: 540 bytes, offsets of nifti2.h.
  std::string bytes(544, '\0');
  const auto set = [&bytes](std::size_t offset, auto value) {
    std::memcpy(&bytes[offset], &value, sizeof value);
  };
  set(0, std::int32_t{540});
  std::memcpy(&bytes[4], "n+2\0\r\n\x1a\n", 8);
  set(12, kUint8);
  set(14, std::int16_t{8});
  const std::int64_t dims[8] = {3, 2, 3, 4, 1, 1, 1, 1};
  for (std::size_t i = 0; i < 8; ++i) set(16 + 8 * i, dims[i]);
  for (std::size_t i = 0; i < 8; ++i) set(104 + 8 * i, 1.0);  // pixdim
  set(168, std::int64_t{544});                                // vox_offset
  set(112, 2.0);
  set(348, std::int32_t{1});  // sform_code
  const double rows[12] = {2, 0, 0, -90, 0, 1, 0, -125, 0, 0, 1, -71};
  for (std::size_t i = 0; i < 12; ++i) set(400 + 8 * i, rows[i]);
  set(500, std::int32_t{2});  // mm
  const auto image =
      value_or_fail(read_nifti(folder_.write("two.nii", bytes + voxels<std::uint8_t>(24))));
  EXPECT_EQ(image.values[23], 24.0f);
  EXPECT_LT((image.T_ras_voxel * Vec3(1, 0, 0) - Vec3(-88, -125, -71)).norm(), 1e-9);
}

TEST_F(ImageFile, FourDimensionsWithOneVolumeAreAccepted) {
  EXPECT_TRUE(read(Header().dims({4, 2, 3, 4, 1}), voxels<float>(24)));
}

TEST_F(ImageFile, TruncatedGzipIsRefused) {
  const std::string whole = gzipped(Header().bytes() + voxels<float>(24));
  EXPECT_THAT(refusal_of(read_nifti(folder_.write("t.nii.gz", whole.substr(0, whole.size() - 20))),
                         ErrorCode::kUnreadable),
              HasSubstr("t.nii.gz: "));
}

TEST_F(ImageFile, VoxelsThatBeginOutsideTheFileOrInItsHeaderAreRefused) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const float offset : {-1.0f, -352.0f, 1.0f, 347.0f, 352.5f, 1e9f, 4294967296.0f, 1e30f, kInf,
                             -kInf, kNan}) {  // 2^32 overflows an int
    EXPECT_THAT(refusal(Header().set<float>(108, offset)), HasSubstr("vox_offset is ")) << offset;
  }
}

TEST_F(ImageFile, VoxelsOfAPairThatBeginOutsideTheSecondFileAreRefused) {
  for (const float offset : {-1.0f, 1.0f, 1e30f, std::numeric_limits<float>::quiet_NaN()}) {
    std::string bytes = Header().set<float>(108, offset).bytes();
    std::memcpy(&bytes[344], "ni1", 4);
    folder_.write("pair.img", voxels<float>(24));
    testing::internal::CaptureStderr();
    EXPECT_FALSE(read_nifti(folder_.write("pair.hdr", bytes))) << offset;
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  }
}

TEST_F(ImageFile, VoxelsRightBehindTheHeaderWithoutAnOffsetAreRead) {
  std::string bytes = Header().set<float>(108, 0.0f).bytes();
  bytes.resize(348);
  const auto image = value_or_fail(read_nifti(folder_.write("i.nii", bytes + voxels<float>(24))));
  EXPECT_EQ(image.values[23], 24.0f);
}

// Some made libnifti print a line of its own.
TEST_F(ImageFile, BadHeadersAreRefusedInOneLine) {
  const auto sform = [](std::array<float, 12> rows) { return Header().sform(rows); };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::array<char, 12> text = {'<', 'n', 'i', 'f', 't', 'i', '_', 'i', 'm', 'a', 'g', 'e'};
  const std::pair<Header, const char*> cases[] = {
      {Header().dims({0, 2, 3, 4}), "not a 3-D image (0 dimensions)"},
      {Header().dims({9, 2, 3, 4}), "not a 3-D image (9 dimensions)"},
      {Header().dims({-3, 2, 3, 4}), "not a 3-D image"},
      {Header().dims({2, 4, 6}), "not a 3-D image"},
      {Header().dims({3, 0, 3, 4}), "not a 3-D image"},
      {Header().dims({3, -2, 3, 4}), "not a 3-D image"},
      {Header().dims({4, 2, 3, 4, 2}), "dimension 4 has 2 entries"},
      // A billion voxels: refused without allocation.
      {Header().dims({3, 30000, 30000, 30000}), "truncated"},
      {Header().type(0, 32), "is not supported"},
      {Header().type(1, 32), "is not supported"},
      {Header().type(3, 32), "is not supported"},
      {Header().type(999, 32), "is not supported"},
      {Header().type(-1, 32), "is not supported"},
      {Header().type(kComplex64, 64), "COMPLEX64"},
      {Header().type(kRgb, 24), "RGB24"},
      {Header().set(0, text), "is not a NIfTI image"},
      {Header().no_sform(), "no affine"},
      {sform({1, 0, 0, nan, 0, 1, 0, 0, 0, 0, 1, 0}), "sform has entries that are not finite"},
      {sform({1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0}), "sform is singular"},
      {sform({}), "sform is singular"},
      // Metres and micrometres.
      {Header().set<char>(123, 1), "must be mm"},
      {Header().set<char>(123, 3), "must be mm"}};
  for (const auto& [header, words] : cases) {
    EXPECT_THAT(refusal(header, voxels<double>(48)), HasSubstr(words));
  }
  EXPECT_THAT(refusal(Header(), voxels<float>(23)), HasSubstr("truncated"));
}

TEST_F(ImageFile, ATruncatedNifti2HeaderIsRefusedInOneLine) {
  std::string bytes(400, '\0');
  const std::int32_t size = 540;
  std::memcpy(bytes.data(), &size, sizeof size);
  std::memcpy(&bytes[4], "n+2\0\r\n\x1a\n", 8);
  testing::internal::CaptureStderr();
  const auto image = read_nifti(folder_.write("two.nii", bytes));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_THAT(sentence_of(image), HasSubstr("is not a NIfTI image"));
}

TEST_F(ImageFile, SmallVoxelsAreNotTakenForASingularAffine) {
  EXPECT_TRUE(
      read(Header().sform({.001f, 0, 0, 0, 0, .001f, 0, 0, 0, 0, .001f, 0}), voxels<float>(24)));
}

// libnifti reads a slope or intercept that is not finite as 0: no scaling, or no shift.
TEST_F(ImageFile, NonFiniteScalingIsIgnored) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto plain = value_or_fail(read(Header(), voxels<float>(24)));
  for (const float slope : {kInf, -kInf, kNan}) {
    const auto image = value_or_fail(read(Header().scaling(slope, 5.0f), voxels<float>(24)));
    EXPECT_EQ(image.values, plain.values) << slope;
  }
  const auto twice = value_or_fail(read(Header().scaling(2.0f, kNan), voxels<float>(24)));
  for (std::size_t i = 0; i < plain.values.size(); ++i) {
    EXPECT_EQ(twice.values[i], 2.0f * plain.values[i]);
  }
}

TEST_F(ImageFile, MissingFileIsNotFoundEvenBesideAGzippedOne) {
  folder_.write("x.nii.gz", gzipped(Header().bytes() + voxels<float>(24)));
  EXPECT_THAT(refusal_of(read_nifti(folder_ / "x.nii"), ErrorCode::kNotFound),
              HasSubstr("x.nii: no such file"));
}

TEST_F(ImageFile, MissingVoxelFileOfAPairIsRefused) {
  std::string bytes = Header().bytes();
  std::memcpy(&bytes[344], "ni1", 4);
  EXPECT_FALSE(read_nifti(folder_.write("lone.hdr", bytes)));
}

TEST_F(ImageFile, OtherFilesAreRefused) {
  for (const std::string& content : {std::string(), std::string("hello"), std::string(1000, '\0'),
                                     Header().bytes().substr(0, 100)}) {
    testing::internal::CaptureStderr();
    const auto image = read_nifti(folder_.write("no.nii", content));
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_THAT(refusal_of(image, ErrorCode::kUnreadable), HasSubstr("no.nii: "));
  }
}

TEST_F(ImageFile, AnalyzeImageIsRefusedForItHasNoAffine) {
  std::string bytes = Header().bytes();
  std::memset(&bytes[344], 0, 4);
  folder_.write("old.img", voxels<float>(24));
  EXPECT_FALSE(read_nifti(folder_.write("old.hdr", bytes.substr(0, 348))));
}

}  // namespace
}  // namespace brainshift::io
