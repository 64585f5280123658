// SPDX-License-Identifier: Apache-2.0
#include "client/lib/client_keys.hpp"

#include <gtest/gtest.h>

namespace brainshift::client {
namespace {

TEST(ClientKeys, ANewPairBelongsTogetherAndIsAnotherEachTime) {
  const auto one = new_keys();
  const auto other = new_keys();
  ASSERT_TRUE(one && other);
  EXPECT_NE(one->secret_key, other->secret_key);
  EXPECT_EQ(public_key_of(one->secret_key).value(), one->public_key);
  EXPECT_EQ(public_key_of(other->secret_key).value(), other->public_key);
}

TEST(ClientKeys, ATextThatIsNoKeyHasNoPublicKey) {
  for (const std::string& none : {std::string(), std::string(39, '0'), std::string(40, '"')}) {
    const auto key = public_key_of(none);
    ASSERT_FALSE(key);
    EXPECT_EQ(key.error().code, ErrorCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace brainshift::client
