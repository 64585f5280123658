// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/role.hpp"

#include <gtest/gtest.h>

namespace brainshift {
namespace {

// Allow-lists depend on these words.
TEST(Role, WordsAreStableAndReadBack) {
  EXPECT_EQ(to_string(Role::kViewer), "viewer");
  EXPECT_EQ(to_string(Role::kSource), "source");
  EXPECT_EQ(to_string(Role::kOwner), "owner");
  EXPECT_EQ(to_string(Role::kAdmin), "admin");
  for (const Role role : kAllRoles) EXPECT_EQ(role_from(to_string(role)), role);
  for (const char* none : {"", "root", "Viewer", "viewer "}) EXPECT_FALSE(role_from(none)) << none;
}

TEST(Role, EachIncludesItselfAndTheOnesBeforeIt) {
  for (const Role role : kAllRoles) {
    for (const Role least : kAllRoles) {
      EXPECT_EQ(includes(role, least), static_cast<int>(role) >= static_cast<int>(least));
    }
  }
}

}  // namespace
}  // namespace brainshift
