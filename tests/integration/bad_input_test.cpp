// SPDX-License-Identifier: GPL-3.0-or-later
// Every bad input exits 2 with one line on stderr that names the file, key or set and the value,
// prints nothing to stdout and leaves nothing behind. One input for each way into a refusal; the
// readers' own tests have the other kinds of bad files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/integration/process.hpp"
#include "tests/integration/workspace.hpp"

namespace brainshift::integration {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

void expect_refused(const Finished& finished, const std::string& program,
                    const std::vector<std::string>& says) {
  EXPECT_EQ(finished.exit_status, 2);
  const auto told = lines(finished.err);
  ASSERT_THAT(told, SizeIs(1)) << finished.err;
  EXPECT_THAT(told[0], StartsWith(program + ": "));
  for (const std::string& part : says) EXPECT_THAT(told[0], HasSubstr(part));
}

// A NIfTI-1 volume of 8-bit voxels of 4 mm, all of one value.
std::string nifti(std::uint8_t value) {
  constexpr std::int16_t kSize = 20;
  std::string bytes(352, '\0');
  const auto put = [&bytes](std::size_t at, auto number) {
    std::memcpy(bytes.data() + at, &number, sizeof number);
  };
  put(0, std::int32_t{348});
  put(40, std::int16_t{3});
  for (std::size_t axis = 0; axis < 3; ++axis) put(42 + 2 * axis, kSize);
  put(70, std::int16_t{2});  // unsigned char
  put(72, std::int16_t{8});
  for (std::size_t axis = 0; axis < 3; ++axis) put(80 + 4 * axis, 4.0F);
  put(108, 352.0F);
  bytes[123] = 2;  // mm
  put(254, std::int16_t{1});
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put(280 + 16 * axis + 4 * axis, 4.0F);
    put(280 + 16 * axis + 12, -40.0F);
  }
  std::memcpy(bytes.data() + 344, "n+1", 4);
  return bytes + std::string(kSize * kSize * kSize, static_cast<char>(value));
}

// Gmsh 2.2 text: a block of cubes, each five tetrahedra, of the given
// edge length in the file's unit.
std::string msh(double edge, bool inverted, bool flat) {
  constexpr int kCells = 6;
  const auto node = [](int i, int j, int k) {
    return 1 + i + (kCells + 1) * (j + (kCells + 1) * k);
  };
  std::ostringstream nodes;
  for (int k = 0; k <= kCells; ++k) {
    for (int j = 0; j <= kCells; ++j) {
      for (int i = 0; i <= kCells; ++i) {
        nodes << node(i, j, k) << ' ' << edge * i << ' ' << edge * j << ' '
              << (flat ? 0.0 : edge * k) << '\n';
      }
    }
  }
  // Kuhn's six tetrahedra of a cube, all along its diagonal: they fit from cube to cube.
  constexpr std::array<std::array<int, 3>, 6> kOrders = {
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  std::ostringstream tets;
  int count = 0;
  for (int c = 0; c < kCells * kCells * kCells; ++c) {
    const std::array<int, 3> cell = {c % kCells, c / kCells % kCells, c / kCells / kCells};
    for (std::size_t o = 0; o < kOrders.size(); ++o) {
      std::array<int, 3> at = cell;
      std::array<int, 4> corners{};
      corners[0] = node(at[0], at[1], at[2]);
      for (std::size_t step = 0; step < 3; ++step) {
        ++at[static_cast<std::size_t>(kOrders[o][step])];
        corners[step + 1] = node(at[0], at[1], at[2]);
      }
      const bool odd = o >= 3;
      if (odd != (inverted && count == 100)) std::swap(corners[2], corners[3]);
      tets << ++count << " 4 2 1 1";
      for (const int corner : corners) tets << ' ' << corner;
      tets << '\n';
    }
  }
  std::ostringstream file;
  file << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n"
       << (kCells + 1) * (kCells + 1) * (kCells + 1) << '\n'
       << nodes.str() << "$EndNodes\n$Elements\n"
       << count << '\n'
       << tets.str() << "$EndElements\n";
  return file.str();
}

struct BadCase {
  const char* name;
  // Makes the case file in the workspace; returns its path.
  std::function<std::string(const Workspace&)> make;
  std::vector<std::string> says;
};

void PrintTo(const BadCase& bad, std::ostream* stream) { *stream << bad.name; }

// The coarse case with one line replaced.
std::function<std::string(const Workspace&)> with(std::string section, std::string key,
                                                  std::string line) {
  return [section = std::move(section), key = std::move(key),
          line = std::move(line)](const Workspace& files) {
    return files.write("bad.yaml", with_line(coarse_case_text(), section, key, line));
  };
}

// The coarse case with a ready mesh instead of the generated one.
std::string mesh_from(const std::string& file) {
  const std::string text = with_line(coarse_case_text(), "mesh", "generate", "file: " + file);
  return with_line(text, "mesh", "edge_mm", "");
}

std::function<std::string(const Workspace&)> with_brain(std::string content) {
  return [content = std::move(content)](const Workspace& files) {
    const auto image = files.write("mask.nii", content);
    return files.write("bad.yaml",
                       with_line(coarse_case_text(), "images", "brain", "brain: " + image));
  };
}

std::function<std::string(const Workspace&)> with_mesh(std::string content) {
  return [content = std::move(content)](const Workspace& files) {
    const auto mesh = files.write("mesh.msh", content);
    return files.write("bad.yaml", mesh_from(mesh));
  };
}

class BadInput : public testing::TestWithParam<BadCase> {};

TEST_P(BadInput, ExitsTwoWithOneLine) {
  ASSERT_TRUE(head_is_installed()) << "Debian's mricron-data is not installed";
  const Workspace files;
  const auto case_file = GetParam().make(files);
  std::filesystem::create_directory(files.path("out"));
  const auto finished = run(
      {brainshiftd(), "prepare", "--case", case_file, "--out", files.path("out/m.h5"), "--json"});
  expect_refused(finished, "brainshiftd", GetParam().says);
  EXPECT_EQ(finished.out, "");
  EXPECT_TRUE(std::filesystem::is_empty(files.path("out"))) << "something half-written was left";
}

INSTANTIATE_TEST_SUITE_P(
    Table, BadInput,
    testing::Values(
        BadCase{"NoCaseFile",
                [](const Workspace& files) { return files.path("none.yaml"); },
                {"none.yaml"}},
        BadCase{"CaseFileThatIsNoYaml",
                [](const Workspace& files) { return files.write("bad.yaml", "a: [1, 2\nb"); },
                {"bad.yaml"}},
        BadCase{"MissingImage",
                with("images", "brain", "brain: /nonexistent/brain.nii.gz"),
                {"/nonexistent/brain.nii.gz"}},
        BadCase{"ImageThatIsNone", with_brain("not an image"), {"mask.nii"}},
        BadCase{"MaskWithoutComponent", with_brain(nifti(0)), {"brain"}},
        BadCase{"UnknownKey", with("mesh", "edge_mm", "edge_cm: 1.2"), {"bad.yaml", "edge_cm"}},
        BadCase{"EdgeInMetres",
                with("mesh", "edge_mm", "edge_mm: 0.012"),
                {"bad.yaml", "edge_mm", "0.012"}},
        BadCase{"TumourOutsideTheBrain",
                with("tumour", "centre_mm", "centre_mm: [470.0, -45.0, 2.0]"),
                {"tumour"}},
        BadCase{"CraniotomyThatSelectsNoNode",
                [](const Workspace& files) {
                  const auto text = with_line(coarse_case_text(), "craniotomy", "long_axis_mm",
                                              "long_axis_mm: 1.0");
                  return files.write("bad.yaml", with_line(text, "craniotomy", "short_axis_mm",
                                                           "short_axis_mm: 1.0"));
                },
                {"craniotomy"}},
        BadCase{"MissingMesh",
                [](const Workspace& files) {
                  return files.write("bad.yaml", mesh_from("/nonexistent/mesh.msh"));
                },
                {"/nonexistent/mesh.msh"}},
        BadCase{"InvertedTetrahedron", with_mesh(msh(25.0, true, false)), {"mesh.msh"}},
        BadCase{"FlatTetrahedra", with_mesh(msh(25.0, false, true)), {"mesh.msh"}},
        BadCase{"MeshInMetres", with_mesh(msh(0.025, false, false)), {"mesh.msh"}},
        BadCase{"MeshFreeToFloat",
                [](const Workspace& files) {
                  return files.write("bad.yaml",
                                     coarse_case_text() + "\ncontact:\n  slave_depth_mm: 300.0\n");
                },
                {"fixed"}}),
    [](const auto& row) { return std::string(row.param.name); });

// ---------- usage ----------

TEST(BadUsage, ExitsTwoWithOneLine) {
  const Workspace files;
  const auto config = files.write("daemon.yaml", "endpoint: tcp://127.0.0.1:*\n");
  const auto unknown = files.write("unknown.yaml", "enpoint: tcp://127.0.0.1:*\n");
  const auto no_folder = files.write("folder.yaml", "journal_dir: /nonexistent/journal\n");
  const auto garbage = files.write("garbage.h5", "not a model");
  const std::vector<std::pair<std::vector<std::string>, std::string>> table = {
      {{}, "subcommand"},
      {{"dance"}, "dance"},
      {{"prepare"}, "--case"},
      {{"prepare", "--case", coarse_case()}, "--out"},
      {{"prepare", "--case", coarse_case(), "--out", "m.h5", "--fast"}, "--fast"},
      {{"prepare", "--case", coarse_case(), "--out", "/nonexistent/m.h5"}, "/nonexistent"},
      {{"prepare", "--case", coarse_case(), "--out", files.folder().string()}, "folder"},
      {{"serve"}, "--config"},
      {{"serve", "--config", files.path("none.yaml")}, "none.yaml"},
      {{"serve", "--config", unknown}, "enpoint"},
      {{"serve", "--config", no_folder}, "/nonexistent/journal"},
      {{"serve", "--config", config, "--model", files.path("none.h5")}, "none.h5"},
      {{"serve", "--config", config, "--model", garbage}, "garbage.h5"},
      {{"serve", "--config", config, "--endpoint", "nonsense"}, "nonsense"}};
  for (const auto& [arguments, says] : table) {
    std::vector<std::string> argv = {brainshiftd()};
    argv.insert(argv.end(), arguments.begin(), arguments.end());
    SCOPED_TRACE(testing::PrintToString(arguments));
    const Finished finished = run(argv, 30.0);
    expect_refused(finished, "brainshiftd", {says});
    EXPECT_EQ(finished.out, "");
  }
}

// Each would make the daemon serve nobody, or everybody, or end a file.
TEST(BadUsage, EndpointsThatMayNotServeAreRefusedInOneLine) {
  const Workspace files;
  const auto config = files.write("daemon.yaml", "endpoint: tcp://127.0.0.1:*\n");
  const auto open = files.write("open.yaml", "endpoint: tcp://0.0.0.0:*\n");
  const auto keyless =
      files.write("keyless.yaml", "endpoint: tcp://0.0.0.0:*\nallow_remote: true\n");
  const auto patient = files.write("patient.h5", "model");
  const std::vector<std::pair<std::vector<std::string>, std::string>> table = {
      {{"--config", config, "--endpoint", "inproc://x"}, "inproc://x"},
      {{"--config", config, "--endpoint", "tcp://0.0.0.0:*"}, "allow_remote"},
      {{"--config", config, "--endpoint", "tcp://*:*"}, "allow_remote"},
      {{"--config", config, "--endpoint", "ipc://@x"}, "ipc://@x"},
      {{"--config", config, "--endpoint", "ipc://" + patient}, "no socket"},
      {{"--config", config, "--endpoint", "ipc://" + files.path("no/s")}, "does not exist"},
      {{"--config", keyless}, "security.secret_key is missing"},
      {{"--config", open}, "open.yaml"}};
  for (const auto& [arguments, says] : table) {
    std::vector<std::string> argv = {brainshiftd(), "serve"};
    argv.insert(argv.end(), arguments.begin(), arguments.end());
    SCOPED_TRACE(testing::PrintToString(arguments));
    expect_refused(run(argv, 30.0), "brainshiftd", {says});
  }
  EXPECT_TRUE(std::filesystem::is_regular_file(patient));
}

TEST(BadUsage, KeysThatOthersMayUseAreRefusedInOneLine) {
  const Workspace files;
  const std::string folder = files.folder().string();
  EXPECT_EQ(run({brainshift(), "keys", "make", "daemon", "--dir", folder}).exit_status, 0);
  EXPECT_EQ(run({brainshift(), "keys", "add", "--allow", files.path("list"), "--role", "owner",
                 files.path("daemon.public")})
                .exit_status,
            0);
  const auto config = files.write("daemon.yaml",
                                  "endpoint: tcp://127.0.0.1:*\nsecurity:\n"
                                  "  secret_key: daemon.secret\n  allow_list: list\n");
  {
    Background daemon({brainshiftd(), "serve", "--config", config}, files.path("log"));
    EXPECT_THAT(daemon.first_line(), StartsWith("listening on tcp://"));
    EXPECT_EQ(daemon.end(SIGTERM), 0);
  }
  std::filesystem::permissions(files.path("daemon.secret"), std::filesystem::perms(0644));
  expect_refused(run({brainshiftd(), "serve", "--config", config}, 30.0), "brainshiftd",
                 {"daemon.secret", "mode 644", "chmod 600"});
  expect_refused(run({brainshift(), "keys", "check", files.path("daemon.secret")}), "brainshift",
                 {"daemon.secret", "mode 644"});
  expect_refused(run({brainshift(), "keys", "make", "daemon", "--dir", folder}), "brainshift",
                 {"daemon.secret", "never overwritten"});
}

TEST(GoodUsage, TheSocketOfAnIpcEndpointIsForTheOwnerAlone) {
  const Workspace files;
  const auto config = files.write("daemon.yaml", "endpoint: ipc://" + files.path("socket") + "\n");
  Background daemon({brainshiftd(), "serve", "--config", config}, files.path("log"));
  ASSERT_THAT(daemon.first_line(), StartsWith("listening on ipc://"));
  using std::filesystem::perms;
  EXPECT_EQ(std::filesystem::status(files.path("socket")).permissions(),
            perms::owner_read | perms::owner_write);
  // A second daemon does not take the endpoint over.
  const Finished second = run({brainshiftd(), "serve", "--config", config}, 30.0);
  EXPECT_EQ(second.exit_status, 1);
  EXPECT_THAT(second.err, HasSubstr("another process listens"));
  EXPECT_EQ(daemon.end(SIGTERM), 0);
}

TEST(GoodUsage, HelpTeachesAndVersionTells) {
  const Finished help = run({brainshiftd(), "--help"});
  EXPECT_EQ(help.exit_status, 0);
  EXPECT_THAT(help.out, AllOf(HasSubstr("prepare"), HasSubstr("serve"), HasSubstr("Examples:")));
  for (const char* command : {"prepare", "serve"}) {
    const Finished detail = run({brainshiftd(), command, "--help"});
    EXPECT_EQ(detail.exit_status, 0);
    EXPECT_THAT(detail.out, HasSubstr("Examples:"));
  }
  const Finished version = run({brainshiftd(), "--version"});
  EXPECT_EQ(version.exit_status, 0);
  EXPECT_THAT(version.out, StartsWith("brainshiftd "));
}

TEST(BadUsage, OfTheClientExitsTwoWithOneLine) {
  const Workspace files;
  const std::vector<std::vector<std::string>> table = {
      {},
      {"dance"},
      {"simulate", "--case", coarse_case(), "--scenario", "none", "--out", files.path("s.surgery")},
      {"replay", files.path("none.surgery"), "--report", files.path("r.json")},
      {"report", files.path("none.json"), "--out", files.path("report")}};
  for (const auto& arguments : table) {
    std::vector<std::string> argv = {brainshift()};
    argv.insert(argv.end(), arguments.begin(), arguments.end());
    SCOPED_TRACE(testing::PrintToString(arguments));
    expect_refused(run(argv, 30.0), "brainshift", {});
  }
}

// Every option that names an output. The inputs do not exist: the outputs are looked at first.
TEST(BadOutput, IsRefusedBeforeTheWorkWithOptionAndPath) {
  const Workspace files;
  const std::string none = files.path("none");
  const std::string good = files.path("good.json");
  const std::vector<std::pair<std::string, std::vector<std::string>>> commands = {
      {"--out", {brainshiftd(), "prepare", "--case", none, "--out"}},
      {"--out", {brainshift(), "simulate", "--case", none, "--scenario", "paper", "--out"}},
      {"--report", {brainshift(), "replay", none, "--report"}},
      {"--latency-csv", {brainshift(), "replay", none, "--report", good, "--latency-csv"}},
      {"--out", {brainshift(), "solve", "--problem", none, "--out"}},
      {"--probes", {brainshift(), "solve", "--problem", none, "--out", good, "--probes"}},
      {"--out", {brainshift(), "import", "--recording", none, "--out"}},
      {"--out",
       {brainshift(), "stereo", "calibrate", "--left", none, "--right", none, "--square-mm", "5",
        "--out"}},
      {"--out",
       {brainshift(), "stereo", "reconstruct", "--left", none, "--right", none, "--calibration",
        none, "--pose", none, "--out"}},
      {"--disparity-png",
       {brainshift(), "stereo", "reconstruct", "--left", none, "--right", none, "--calibration",
        none, "--pose", none, "--out", good, "--disparity-png"}},
      {"--out",
       {brainshift(), "stereo", "observe", "--surface", none, "--model", none, "--sd-mm", "1",
        "--out"}}};
  const std::string pipe = files.path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const auto& [option, command] : commands) {
    for (const std::string& path : {std::string("/dev/null"), pipe, files.folder().string(),
                                    files.path("no/out"), std::string("/proc/out")}) {
      std::vector<std::string> argv = command;
      argv.push_back(path);
      SCOPED_TRACE(testing::PrintToString(argv));
      const std::string program = argv[0] == brainshiftd() ? "brainshiftd" : "brainshift";
      expect_refused(run(argv, 30.0), program, {option + ": " + path + ": "});
    }
  }
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_FALSE(std::filesystem::exists(good));
}

TEST(BadOutput, AReportsFolderIsLookedAtBeforeTheWork) {
  const Workspace files;
  const std::string file = files.write("file", "");
  for (const std::string& path : {file, file + "/below", std::string("/dev/null")}) {
    expect_refused(run({brainshift(), "report", files.path("none.json"), "--out", path}, 30.0),
                   "brainshift", {"--out: " + path + ": "});
  }
}

}  // namespace
}  // namespace brainshift::integration
