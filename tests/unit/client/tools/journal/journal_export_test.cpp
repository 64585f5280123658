// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/journal/journal_export.hpp"

#include <gmock/gmock.h>

#include <hdf5.h>

#include <algorithm>
#include <sstream>
#include <vector>

#include "common/io/config/config_file.hpp"
#include "common/io/geometry/mesh_file.hpp"
#include "common/io/model/model_file.hpp"
#include "tests/support/results.hpp"
#include "tests/unit/client/tools/journal/small_journal.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class ExportJournal : public SmallJournal {
 protected:
  io::SurgeryFile open() const { return std::move(*io::SurgeryFile::open(path)); }
  fs::path model_file() const {
    io::ModelFile file;
    file.config = io::parse_case_config(R"(case_id: toy
images: {brain: mask.nii}
tumour: {ellipsoid: {centre_mm: [30, 30, 40], semi_axes_mm: [10, 10, 10]}}
craniotomy: {centre_mm: [30, 30, 60]}
brainstem: {centre_mm: [30, 30, 0]}
)",
                                        folder / "toy.yaml")
                      .value();
    file.model = model;
    const Status written = io::write_model(folder / "m.h5", file);
    EXPECT_TRUE(written) << written.error().message;
    return folder / "m.h5";
  }
};

TEST_F(ExportJournal, TheTableHasARowPerRecord) {
  write(path, 3);
  const auto csv = value_or_fail(records_csv(open(), path));
  std::istringstream stream(csv);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 7u);
  const auto columns = std::count(lines[0].begin(), lines[0].end(), ',');
  for (const std::string& line : lines) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), columns) << line;
  }
  EXPECT_THAT(lines[0], testing::StartsWith("record,kind,sequence,source,recorded_s,bytes,"));
  EXPECT_THAT(lines[1], testing::StartsWith("1,observation,1,ius,0.000000,"));
  EXPECT_THAT(lines[5], testing::StartsWith("5,observation,3,camera,2.000000,"));
  EXPECT_THAT(lines[6], testing::StartsWith("6,update,3,,2.250000,"));
  EXPECT_THAT(lines[6],
              HasSubstr(",3,converged,caution,strength_at_bound+deadline,0.0000,2.5000,"));
  EXPECT_THAT(lines[6], testing::EndsWith(",11,0.375000"));
}

TEST_F(ExportJournal, ADecisionIsARowWithItsOutcome) {
  write_records({decision(4, Outcome::kSuperseded)});
  const std::string csv = records_csv(open(), path).value();
  const std::string row = csv.substr(csv.find('\n') + 1);
  EXPECT_THAT(row, testing::StartsWith("1,decision,4,ius,0.000000,"));
  EXPECT_THAT(row, testing::EndsWith(",4,superseded,,,,,,,,11,\n"));
  EXPECT_EQ(std::count(row.begin(), row.end(), ','), std::count(csv.begin(), csv.end(), ',') / 2);
}

TEST_F(ExportJournal, ASourceWithACommaStaysOneField) {
  write_records({observation(1, "a \"b\", c")});
  EXPECT_THAT(records_csv(open(), path).value(), HasSubstr(",\"a \"\"b\"\", c\","));
}

TEST_F(ExportJournal, ABrokenFileGivesNoTable) {
  write(path, 3);
  run_sql(path, "UPDATE record SET sequence = 9 WHERE id = 4");
  EXPECT_THAT(sentence_of(records_csv(open(), path)), HasSubstr("record 4"));
}

TEST_F(ExportJournal, TheSeriesHasAFieldPerUsableUpdateAndAListByTime) {
  write(path, 2);
  const auto recorded = value_or_fail(recorded_model(open(), path, model_file()));
  const fs::path to = folder / "fields";
  const auto fields = value_or_fail(write_field_series(open(), path, recorded, to));
  EXPECT_EQ(fields, 2);
  const std::string list = test_support::content_of(to / "a.pvd");
  EXPECT_THAT(list, HasSubstr("timestep=\"0.250000\" file=\"a-000001.vtu\""));
  EXPECT_THAT(list, HasSubstr("timestep=\"1.250000\" file=\"a-000002.vtu\""));
  const auto read = value_or_fail(io::read_vtu(to / "a-000002.vtu"));
  EXPECT_EQ(read.mesh.num_nodes(), model.mesh.num_nodes());
  ASSERT_EQ(read.node_fields.size(), 3u);
  EXPECT_EQ(read.node_fields[0].name, "displacement");
  EXPECT_EQ(read.node_fields[0].values(0, 5), 0.25);
  EXPECT_EQ(read.node_fields[1].values(0, 5), 0.5);
  EXPECT_EQ(read.node_fields[2].name, "known");
  EXPECT_NEAR(read.node_fields[2].values(0, 5), 0.2, 1e-9);
}

// Read with HDF5's own high-level calls, as another program would.
std::vector<float> floats(hid_t file, const std::string& name) {
  const hid_t set = H5Dopen2(file, name.c_str(), H5P_DEFAULT);
  EXPECT_GE(set, 0) << name;
  const hid_t space = H5Dget_space(set);
  std::vector<float> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  EXPECT_GE(H5Dread(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  H5Sclose(space);
  H5Dclose(set);
  return values;
}

TEST_F(ExportJournal, TheFileHoldsTheMeshAndAFieldPerUsableUpdate) {
  write(path, 2);
  const fs::path out = folder / "fields.h5";
  const auto fields = value_or_fail(write_field_file(open(), path, model, out));
  EXPECT_EQ(fields, 2);
  const hid_t file = H5Fopen(out.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  const auto nodes = floats(file, "mesh/nodes_mm");
  const auto displacement = floats(file, "updates/000002/displacement_mm");
  const auto sd = floats(file, "updates/000002/sd_mm");
  const auto known = floats(file, "updates/000002/known");
  H5Fclose(file);
  ASSERT_EQ(nodes.size(), static_cast<std::size_t>(model.mesh.nodes.size()));
  EXPECT_EQ(nodes[3 * 5 + 1], static_cast<float>(model.mesh.nodes(1, 5)));
  ASSERT_EQ(displacement.size(), nodes.size());
  EXPECT_EQ(displacement[3 * 5], 0.25f);
  EXPECT_EQ(displacement[3 * 5 + 1], 0.0f);
  ASSERT_EQ(3 * sd.size(), nodes.size());
  EXPECT_EQ(sd[5], 0.5f);
  ASSERT_EQ(known.size(), sd.size());
  EXPECT_EQ(known[5], 0.2f);
}

TEST_F(ExportJournal, AFileIsNotLeftBehindHalfWritten) {
  write_records({observation(1, "ius")}, {.model_id = model.model_id});
  const auto before = std::distance(fs::directory_iterator(folder / "."), fs::directory_iterator());
  refusal_of(write_field_file(open(), path, model, folder / "fields.h5"), ErrorCode::kEmptySet);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "."), fs::directory_iterator()), before);
}

TEST_F(ExportJournal, AnotherModelIsRefused) {
  auto file = value_or_fail(io::SurgeryFile::create(path, {.model_id = "other"}));
  ASSERT_TRUE(file.append(update(1, 1)));
  EXPECT_THAT(refusal_of(recorded_model(file, path, model_file()), ErrorCode::kInvalidArgument),
              HasSubstr("\"other\""));
}

}  // namespace
}  // namespace brainshift::client
