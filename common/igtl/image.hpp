// SPDX-License-Identifier: Apache-2.0
// IMAGE: a volume of scalars or vectors. Content: 72 bytes header (big-endian), then the voxels.
//   offset  size  field
//        0     2  version          1
//        2     1  components       1: scalar; interleaved otherwise
//        3     1  scalar type      2 int8 3 uint8 4 int16 5 uint16 6 int32 7 uint32 10 float32
//                                  11 float64
//        4     1  endian           of the voxels; 1 big, 2 little
//        5     1  coordinates      1 RAS, 2 LPS
//        6   3*2  dims             voxels along i, j, k
//       12   3*4  T                float32, mm: step to the next voxel along i
//       24   3*4  S                along j
//       36   3*4  N                along k
//       48   3*4  centre           of the whole volume, mm
//       60   3*2  offset           first voxel of the part that is sent
//       66   3*2  part             voxels of that part; equals dims where the volume is whole
// Voxel order: i fastest. The centre of voxel (i, j, k) is
//   centre + T (i - (dims_i - 1) / 2) + S (j - (dims_j - 1) / 2) + N (k - (dims_k - 1) / 2),
// as 3D Slicer reads it (vtkIGTLToMRMLImage.cxx), for even and odd dims.
//
// Readers in 3D Slicer ignore the coordinates flag: send RAS. They ignore the components of partial
// volumes: send whole ones (SlicerOpenIGTLink, OpenIGTLinkIO).
// Source: Documents/Protocol/image.md of github.com/openigtlink/OpenIGTLink.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/core/error.hpp"
#include "common/core/types.hpp"

namespace brainshift::igtl {

enum class Coordinates : std::uint8_t { kRas = 1, kLps = 2 };

struct ImageGeometry {
  std::array<int, 3> dims{0, 0, 0};  // 1 to 65535 each
  // Columns T, S, N: steps in mm. Single precision, as the message has them.
  Eigen::Matrix3f steps = Eigen::Matrix3f::Identity();
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  Coordinates coordinates = Coordinates::kRas;

  std::size_t num_voxels() const;
  // Position in RAS, mm, of the centre of voxel (i, j, k), whatever the coordinates flag is.
  AffineTransform T_ras_voxel() const;

  friend bool operator==(const ImageGeometry&, const ImageGeometry&) = default;
};

// The geometry of a volume whose voxel (i, j, k) lies at T_ras_voxel * (i, j, k), mm RAS.
ImageGeometry image_geometry(const std::array<int, 3>& dims, const AffineTransform& T_ras_voxel);

// Numbers in the machine's byte order; the type of the vector is the scalar type.
using Voxels =
    std::variant<std::vector<std::int8_t>, std::vector<std::uint8_t>, std::vector<std::int16_t>,
                 std::vector<std::uint16_t>, std::vector<std::int32_t>, std::vector<std::uint32_t>,
                 std::vector<float>, std::vector<double>>;

struct Image {
  static constexpr std::string_view kType = "IMAGE";

  ImageGeometry geometry;
  int components = 1;                  // 1 to 255
  std::array<int, 3> offset{0, 0, 0};  // of the part that is here
  std::array<int, 3> part{0, 0, 0};    // its voxels along i, j, k
  // components * part[0] * part[1] * part[2] numbers: component fastest, then i.
  Voxels voxels;

  bool is_whole() const { return part == geometry.dims; }
  friend bool operator==(const Image&, const Image&) = default;
};

// A whole volume whose numbers stay where they are: component fastest, then i.
struct ImageView {
  static constexpr std::string_view kType = "IMAGE";

  ImageGeometry geometry;
  int components = 1;
  std::variant<std::span<const float>, std::span<const std::uint8_t>> voxels;
};

// kInvalidArgument, kNotFinite: dims, components, part or offset outside their ranges, a step or
// centre that is not finite, steps that are zero or parallel along axes of more than one voxel, the
// wrong number of voxels.
Status validate(const Image& image);
Status validate(const ImageView& image);

// Appends the content; the voxels little-endian. Precondition: validate().
void append_content(const Image& image, std::string& out);
void append_content(const ImageView& image, std::string& out);

// kProtocol: an unknown version or type, sizes that do not fit the content, or what validate()
// refuses. The content's size is compared before any memory is taken.
Result<Image> decode_image(std::string_view content);

}  // namespace brainshift::igtl
