// SPDX-License-Identifier: Apache-2.0
// Messages written by a second, independent implementation (tests/data/igtl/make_vectors.py), most
// of them with metadata: encoding the described values gives the same bytes, and decoding the bytes
// gives the described values.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "common/igtl/message.hpp"
#include "common/igtl/stream_reader.hpp"
#include "tests/support/results.hpp"

namespace brainshift::igtl {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const fs::path kFolder = fs::path(BRAINSHIFT_SOURCE_DIR) / "tests/data/igtl";

std::string read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  std::ostringstream content;
  content << file.rdbuf();
  return content.str();
}

// ---------- contents from their description ----------

template <typename T>
Voxels voxels_as(const json& numbers) {
  return numbers.get<std::vector<T>>();
}

Voxels voxels_from(const std::string& scalar, const json& numbers) {
  if (scalar == "uint8") return voxels_as<std::uint8_t>(numbers);
  if (scalar == "int16") return voxels_as<std::int16_t>(numbers);
  EXPECT_EQ(scalar, "float32");
  return voxels_as<float>(numbers);
}

Eigen::Vector3f vector_from(const json& numbers) {
  return {numbers[0].get<float>(), numbers[1].get<float>(), numbers[2].get<float>()};
}

Content image_from(const json& v) {
  Image image;
  image.geometry.dims = v["dims"].get<std::array<int, 3>>();
  for (int axis = 0; axis < 3; ++axis) {
    image.geometry.steps.col(axis) = vector_from(v["steps"][static_cast<std::size_t>(axis)]);
  }
  image.geometry.centre = vector_from(v["centre"]);
  image.geometry.coordinates = static_cast<Coordinates>(v["coordinates"].get<int>());
  image.components = v["components"].get<int>();
  image.offset = v["offset"].get<std::array<int, 3>>();
  image.part = v["part"].get<std::array<int, 3>>();
  image.voxels = voxels_from(v["scalar"].get<std::string>(), v["voxels"]);
  return image;
}

Matrix34f matrix_from(const json& rows) {
  Matrix34f matrix;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      matrix(row, column) =
          rows[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)].get<float>();
    }
  }
  return matrix;
}

Content tracking_data_from(const json& v) {
  TrackingData data;
  for (const json& tool : v["tools"]) {
    data.tools.push_back({tool["name"].get<std::string>(),
                          static_cast<ToolType>(tool["type"].get<int>()),
                          matrix_from(tool["rows"])});
  }
  return data;
}

Cells cells_from(const json& list) {
  Cells cells;
  for (const json& cell : list) {
    ++cells.count;
    cells.numbers.push_back(static_cast<std::uint32_t>(cell.size()));
    for (const json& point : cell) cells.numbers.push_back(point.get<std::uint32_t>());
  }
  return cells;
}

Eigen::MatrixXf columns_from(const json& tuples) {
  const std::size_t rows = tuples.empty() ? 0 : tuples[0].size();
  Eigen::MatrixXf matrix(rows, tuples.size());
  for (std::size_t column = 0; column < tuples.size(); ++column) {
    for (std::size_t row = 0; row < rows; ++row) {
      matrix(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) =
          tuples[column][row].get<float>();
    }
  }
  return matrix;
}

Content poly_data_from(const json& v) {
  PolyData data;
  data.points = columns_from(v["points"]);
  data.vertices = cells_from(v["vertices"]);
  data.lines = cells_from(v["lines"]);
  data.polygons = cells_from(v["polygons"]);
  data.triangle_strips = cells_from(v["triangle_strips"]);
  for (const json& attribute : v["attributes"]) {
    const int kind = attribute["kind"].get<int>();
    data.attributes.push_back({attribute["name"].get<std::string>(),
                               static_cast<AttributeKind>(kind % 16), kind >= 16,
                               columns_from(attribute["tuples"])});
  }
  return data;
}

Content point_list_from(const json& v) {
  PointList list;
  for (const json& point : v["points"]) {
    list.points.push_back({point["name"].get<std::string>(), point["group"].get<std::string>(),
                           point["rgba"].get<std::array<std::uint8_t, 4>>(),
                           vector_from(point["position"]), point["diameter"].get<float>(),
                           point["owner"].get<std::string>()});
  }
  return list;
}

Content content_from(const std::string& type, const json& v) {
  if (type == "IMAGE") return image_from(v);
  if (type == "TRANSFORM") return Transform{matrix_from(v["rows"])};
  if (type == "TDATA") return tracking_data_from(v);
  if (type == "POLYDATA") return poly_data_from(v);
  if (type == "POINT") return point_list_from(v);
  if (type == "STRING") {
    return Text{v["text"].get<std::string>(), v["encoding"].get<std::uint16_t>()};
  }
  if (type == "STATUS") {
    return StatusReport{v["code"].get<std::uint16_t>(), v["subcode"].get<std::int64_t>(),
                        v["error_name"].get<std::string>(), v["text"].get<std::string>()};
  }
  if (type == "GET_STATUS") return StatusRequest{};
  if (type == "CAPABILITY") return Capability{v["types"].get<std::vector<std::string>>()};
  EXPECT_EQ(type, "GET_CAPABIL");
  return CapabilityRequest{};
}

Envelope envelope_from(const json& m) {
  Envelope envelope;
  envelope.version = m["version"].get<std::uint16_t>();
  envelope.device = m["device"].get<std::string>();
  envelope.timestamp = m["timestamp"].get<std::uint64_t>();
  envelope.message_id = m.value("message_id", 0u);
  for (const json& entry : m.value("metadata", json::array())) {
    envelope.metadata.push_back(
        {entry[0].get<std::string>(), entry[1].get<std::string>(), entry[2].get<std::uint16_t>()});
  }
  return envelope;
}

// ---------- the tests ----------

class Vectors : public ::testing::TestWithParam<std::string> {
 protected:
  const std::string bytes_ = read_file(kFolder / (GetParam() + ".bin"));
  const json description_ = json::parse(read_file(kFolder / (GetParam() + ".json")));
  const Envelope envelope_ = envelope_from(description_);
  const Content content_ =
      content_from(description_["type"].get<std::string>(), description_["content"]);
};

TEST_P(Vectors, EncodingTheDescribedValuesGivesTheSameBytes) {
  std::string ours;
  const Status status = encode(envelope_, content_, ours);
  ASSERT_TRUE(status) << status.error().message;
  // Two are written in a way that we read but never write.
  EXPECT_EQ(ours == bytes_, !description_.value("decode_only", false));
}

TEST_P(Vectors, DecodingGivesTheDescribedValues) {
  const auto message = value_or_fail(decode(bytes_));
  EXPECT_EQ(message.envelope, envelope_);
  EXPECT_TRUE(message.content == content_);
}

TEST_P(Vectors, AreReadFromAStream) {
  StreamReader reader;
  std::string_view bytes = bytes_;
  const auto packet = value_or_fail(reader.read(bytes));
  ASSERT_TRUE(packet.has_value());
  EXPECT_EQ(packet->header.type, type_of(content_));
  EXPECT_TRUE(bytes.empty());
}

std::vector<std::string> names() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(kFolder)) {
    if (entry.path().extension() == ".bin") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

INSTANTIATE_TEST_SUITE_P(All, Vectors, ::testing::ValuesIn(names()),
                         [](const auto& named) { return named.param; });

// Where the folder is empty, the tests above pass without having run.
TEST(VectorFolder, HasEveryTypeWithMetadata) {
  std::set<std::string> types;
  for (const std::string& name : names()) {
    const auto message = decode(read_file(kFolder / (name + ".bin")));
    ASSERT_TRUE(message) << name;
    if (message->envelope.version == 2) types.emplace(type_of(message->content));
  }
  EXPECT_EQ(types.size(), std::variant_size_v<Content>);
}

}  // namespace
}  // namespace brainshift::igtl
