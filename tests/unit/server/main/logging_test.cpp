// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/logging.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <sstream>
#include <string>
#include <vector>

#include "common/io/files/stop_signals.hpp"

namespace brainshift::server {
namespace {

using testing::ContainsRegex;
using testing::EndsWith;

constexpr int kPipeBytes = 4096;  // the smallest that Linux makes

// A pipe whose reader reads when the test says so.
class Reader {
 public:
  Reader() {
    io::survive_failing_writes();
    if (pipe2(ends_.data(), O_CLOEXEC) != 0) throw std::runtime_error("pipe2");
    fcntl(ends_[1], F_SETPIPE_SZ, kPipeBytes);
  }
  ~Reader() {
    close(ends_[0]);  // a writer that was left behind gets EPIPE
  }
  int write_end() const { return ends_[1]; }
  // Reads up to the first line that contains `text`, or to the end of the stream.
  std::vector<std::string> lines_to(const std::string& text) {
    std::string read_so_far;
    std::array<char, 4096> buffer{};
    while (read_so_far.find(text) == std::string::npos) {
      const ssize_t count = read(ends_[0], buffer.data(), buffer.size());
      if (count <= 0) break;
      read_so_far.append(buffer.data(), static_cast<std::size_t>(count));
    }
    std::vector<std::string> lines;
    std::istringstream stream(read_so_far);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
  }

 private:
  std::array<int, 2> ends_{};
};

LogOptions into(const Reader& reader) {
  LogOptions options;
  options.fd = reader.write_end();
  return options;
}

TEST(Log, ALineHoldsTimeLevelAndWordsAndIsThereAfterTheEnd) {
  Reader reader;
  {
    const Log log(into(reader));
    spdlog::info("session ready session={}", 7);
    spdlog::debug("below the level");
    spdlog::warn("last");
  }
  const auto lines = reader.lines_to("last");
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_THAT(lines[0], ContainsRegex("^20..-..-..T..:..:...*[+-]..:.. info session ready "
                                      "session=7$"));
  EXPECT_THAT(lines[1], EndsWith(" warning last"));
}

TEST(Log, AStalledReaderCostsLinesAndNoWaitingAndEachLostLineIsCounted) {
  constexpr int kLogged = 20000;
  Reader reader;
  LogOptions options = into(reader);
  options.queue_lines = 16;
  const Log log(options);
  for (int i = 0; i < kLogged; ++i) spdlog::info("event {}", i);  // a waiting log never gets past

  const auto lines = reader.lines_to("event " + std::to_string(kLogged - 1) + "\n");
  int written = 0, lost = 0, last = -1;
  for (const std::string& line : lines) {
    const auto notice = line.find(" lines of the log were lost");
    if (notice == std::string::npos) {
      const int event = std::stoi(line.substr(line.rfind(' ')));
      EXPECT_GT(event, last);
      last = event;
      ++written;
    } else {
      lost += std::stoi(line.substr(line.rfind(' ', notice - 1)));
    }
  }
  EXPECT_GT(lost, kLogged / 2);
  EXPECT_EQ(written + lost, kLogged);
}

TEST(Log, TheEndDoesNotWaitForAStalledReader) {
  Reader reader;
  LogOptions options = into(reader);
  options.drain_limit = std::chrono::milliseconds(10);
  {
    const Log log(options);
    for (int i = 0; i < 5000; ++i) spdlog::info("event {}", i);
  }
  SUCCEED();  // an end that waits never gets here
}

TEST(Log, AReaderThatIsGoneEndsNothing) {
  auto reader = std::make_unique<Reader>();
  const Log log(into(*reader));
  reader.reset();
  for (int i = 0; i < 5000; ++i) spdlog::info("event {}", i);
  SUCCEED();
}

TEST(Log, ALineOfAStrangerDrivesNoTerminal) {
  Reader reader;
  {
    const Log log(into(reader));
    spdlog::info("source \x1b[2J\u009b\u202e\nlast");
  }
  const auto lines = reader.lines_to("last");
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], EndsWith(" info source ?[2J???last"));
}

}  // namespace
}  // namespace brainshift::server
