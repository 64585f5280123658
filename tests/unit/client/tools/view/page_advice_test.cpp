// SPDX-License-Identifier: GPL-3.0-or-later
// What it computes is held against `brainshift advise` in a browser, tests/python/test_view.py.
#include "client/tools/view/page_advice.hpp"

#include <gmock/gmock.h>

#include <future>

#include "tests/support/temporary_folder.hpp"

namespace brainshift::client {
namespace {

TEST(PageAdvice, SaysOnceAskedWhyThereIsNone) {
  const test_support::TemporaryFolder folder;
  std::promise<std::string> told;  // a second answer would throw
  PageAdvice advice("/none.h5", folder.path(), [&](std::string json) { told.set_value(json); });
  advice.show({.name = "1.2.3", .session = {}, .boundary = Boundary::kContact, .used = {}});
  auto answer = told.get_future();
  EXPECT_EQ(answer.wait_for(std::chrono::seconds(0)), std::future_status::timeout) << "unasked";
  advice.ask();
  ASSERT_EQ(answer.wait_for(std::chrono::seconds(60)), std::future_status::ready);
  EXPECT_EQ(answer.get(),
            "{\"of\":\"1.2.3\",\"reason\":\"" + folder.path().string() + " holds no journal\"}");
  advice.ask();  // it has been answered
}

}  // namespace
}  // namespace brainshift::client
