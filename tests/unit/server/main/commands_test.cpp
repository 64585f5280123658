// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/commands.hpp"

#include <gmock/gmock.h>

#include "common/io/model/model_file.hpp"
#include "server/main/progress_bar.hpp"
#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::server {
namespace {

TEST(ExitStatus, IsTwoForWhatTheUserCanMendAndOneOtherwise) {
  EXPECT_EQ(exit_status(ErrorCode::kInvalidArgument), 2);
  EXPECT_EQ(exit_status(ErrorCode::kNotFound), 2);
  EXPECT_EQ(exit_status(ErrorCode::kDegenerateMesh), 2);
  EXPECT_EQ(exit_status(ErrorCode::kFloatingBody), 2);
  EXPECT_EQ(exit_status(ErrorCode::kWriteFailed), 1);
  EXPECT_EQ(exit_status(ErrorCode::kInternal), 1);
}

TEST(PrintError, IsOneLine) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(print_error({ErrorCode::kNotFound, "a\nb"}), 2);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "brainshiftd: a b\n");
}

TEST(Prepare, LeavesAFileAloneThatIsNoModel) {
  const test_support::TemporaryFolder folder;
  const auto mine = folder.write("notes.txt", "my notes");
  testing::internal::CaptureStderr();
  EXPECT_EQ(run_prepare({folder / "any.yaml", mine, true}), 2);
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              testing::EndsWith("notes.txt: is there and is no model file: it is not replaced\n"));
  EXPECT_EQ(test_support::content_of(mine), "my notes");
}

TEST(Prepare, TellsWhichModelItReplacesAndWhetherItIsTheSame) {
  BrainModel made;
  made.model_id = "abcd";
  EXPECT_EQ(replacement_text("m.h5", {"head", "abcd", ""}, made),
            "m.h5: replaces the model of case head, abcd: the new one is the same");
  EXPECT_EQ(replacement_text("m.h5", {"head", "0123", ""}, made),
            "m.h5: replaces the model of case head, 0123: the new one is another, abcd");
  EXPECT_EQ(replacement_text("m.h5", {"", "", "m.h5: is damaged"}, made),
            "m.h5: replaces a model that cannot be read: m.h5: is damaged");
}

std::string progress_lines(ProgressBar::Style style) {
  testing::internal::CaptureStdout();
  {
    ProgressBar bar(style);
    const Progress progress = bar.progress("contact");
    report(progress, "assemble", 0.0);
    report(progress, "assemble", 0.5);
    report(progress, "factor", 0.6);
  }
  return testing::internal::GetCapturedStdout();
}

TEST(ProgressBar, PrintsEachStageOnceWithoutATerminalAndNothingWhenSilent) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(progress_lines(ProgressBar::Style::kLines), "contact: assemble\ncontact: factor\n");
  EXPECT_EQ(progress_lines(ProgressBar::Style::kSilent), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ProgressBar, LeavesACleanLineOnATerminal) {
  testing::internal::CaptureStderr();
  {
    ProgressBar bar(ProgressBar::Style::kBar);
    bar.show("", "mesh", 0.5);
  }
  const std::string drawn = testing::internal::GetCapturedStderr();
  EXPECT_THAT(drawn, testing::HasSubstr("[###############...............]  50 %  mesh"));
  EXPECT_THAT(drawn, testing::EndsWith("\r\033[K"));
  EXPECT_THAT(drawn, testing::Not(testing::HasSubstr("\n")));
}

TEST(EndpointToAsk, IsOnThisMachineWhereTheDaemonListensOnAllInterfaces) {
  EXPECT_EQ(*endpoint_to_ask("tcp://0.0.0.0:5555"), "tcp://127.0.0.1:5555");
  EXPECT_EQ(*endpoint_to_ask("tcp://*:5555"), "tcp://127.0.0.1:5555");
  EXPECT_EQ(*endpoint_to_ask("tcp://[::]:5555"), "tcp://[::1]:5555");
}

TEST(EndpointToAsk, IsTheDaemonsOwnOtherwise) {
  for (const char* endpoint :
       {"tcp://127.0.0.1:5555", "tcp://10.0.0.0:5555", "tcp://[::1]:80", "ipc:///run/a.sock"}) {
    EXPECT_EQ(*endpoint_to_ask(endpoint), endpoint);
  }
}

TEST(EndpointToAsk, NeedsAPortThatIsKnown) {
  EXPECT_THAT(refusal_of(endpoint_to_ask("tcp://127.0.0.1:*"), ErrorCode::kInvalidArgument),
              testing::HasSubstr("tcp://127.0.0.1:*"));
}

}  // namespace
}  // namespace brainshift::server
