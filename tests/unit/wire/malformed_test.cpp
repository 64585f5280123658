// SPDX-License-Identifier: GPL-3.0-or-later
// Every row of tests/data/wire/malformed.txt; the Python client's tests read the same.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "common/wire/convert.hpp"
#include "common/wire/frame.hpp"
#include "tests/support/study_record.hpp"

namespace brainshift::wire {
namespace {

std::string bytes_of(const std::string& hex) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

// Why the frame is refused; empty: it is taken.
std::string refusal(const std::string& bytes) {
  const auto frame = decode_frame(bytes);
  if (!frame) return frame.error().message;
  const auto of = [](const auto& result) { return result ? "" : result.error().message; };
  switch (frame->type) {
    case MessageType::kStatusReply: return of(decode_status(frame->payload));
    case MessageType::kStartSessionReply: return of(decode_session_info(frame->payload));
    case MessageType::kModelReply: return of(decode_model(frame->payload));
    case MessageType::kObservation: return of(decode_observation(frame->payload));
    case MessageType::kObservationReply: return of(decode_observation_receipt(frame->payload));
    case MessageType::kUpdate: return of(decode_update(frame->payload));
    case MessageType::kSessionState: return of(decode_session_state(frame->payload));
    case MessageType::kErrorReply: {
      const Error error = decode_error(frame->payload);
      return error.code == ErrorCode::kProtocol ? error.message : "";
    }
    default: return "a type that this test does not know";
  }
}

TEST(MalformedFrames, AreRefusedAsTheTableSays) {
  std::ifstream table(BRAINSHIFT_SOURCE_DIR "/tests/data/wire/malformed.txt");
  std::string verdict, name, hex, line;
  int rows = 0, wrong = 0;
  while (std::getline(table, line)) {
    const std::size_t first = line.find(' ');
    const std::size_t second = line.find(' ', first + 1);
    verdict = line.substr(0, first);
    name = line.substr(first + 1, second - first - 1);
    const std::string why = refusal(bytes_of(line.substr(second + 1)));
    wrong += why.empty() == (verdict == "ok") && why.find('\n') == std::string::npos ? 0 : 1;
    EXPECT_EQ(why.empty(), verdict == "ok") << name << ": " << why;
    EXPECT_EQ(why.find('\n'), std::string::npos) << name;
    ++rows;
  }
  const std::string source = "unit_wire --gtest_filter=MalformedFrames.*";
  EXPECT_TRUE(test_support::record_check("malformed", "rows", rows, ">= 300", rows >= 300, source));
  EXPECT_TRUE(test_support::record_check("malformed", "C++ client: verdicts other than the table's",
                                         wrong, "= 0", wrong == 0, source));
}

}  // namespace
}  // namespace brainshift::wire
