// SPDX-License-Identifier: Apache-2.0
#include "common/core/fnv1a.hpp"

#include <gtest/gtest.h>

namespace brainshift {
namespace {

// From the authors' test suite (isthe.com/chongo/src/fnv/test_fnv.c), 64 bit FNV-1a.
TEST(Fnv1a, MatchesItsAuthorsVectors) {
  EXPECT_EQ(fnv1a(""), 0xcbf29ce484222325ull);
  EXPECT_EQ(fnv1a("a"), 0xaf63dc4c8601ec8cull);
  EXPECT_EQ(fnv1a("foobar"), 0x85944171f73967e8ull);
}

TEST(Fnv1a, PiecesGiveTheHashOfTheWhole) {
  Fnv1a hash;
  hash.add("foo", 3);
  hash.add("bar", 3);
  EXPECT_EQ(hash.value(), fnv1a("foobar"));
}

}  // namespace
}  // namespace brainshift
