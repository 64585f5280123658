// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/main/platform.hpp"

#include <gmock/gmock.h>

namespace brainshift::server {
namespace {

TEST(Platform, AMachineIsCalledWhatItsProcessorSays) {
  constexpr const char* kInfo =
      "processor\t: 0\nvendor_id\t: GenuineIntel\ncpu family\t: 6\nmodel\t\t: 143\n"
      "model name\t: Some Xeon\nflags\t\t: fpu\n\nprocessor\t: 1\nmodel\t\t: 1\n";
  EXPECT_EQ(machine_type("x86_64", kInfo), "x86_64 GenuineIntel family 6 model 143");
  EXPECT_EQ(machine_type("aarch64", "BogoMIPS : 50\n"), "aarch64");
  EXPECT_EQ(machine_type("x86_64", ""), "x86_64");
}

TEST(Platform, ABuildIsItsVersionAndItsBytes) {
  const std::string build = program_build("0.1.0");
  EXPECT_THAT(build, testing::MatchesRegex("0.1.0 crc [0-9a-f]+"));
  EXPECT_EQ(program_build("0.1.0"), build);
  EXPECT_FALSE(machine_type().empty());
}

}  // namespace
}  // namespace brainshift::server
