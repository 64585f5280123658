// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/key_file.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "tests/support/refusals.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;
using test_support::content_of;
using test_support::expect_refused;
using test_support::TemporaryFolder;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

const std::string kPublic = "Yne@$w-vo<fVvi]a<NY6T1ed:M$fCG*[IaLV{hID";
const std::string kSecret = "D:)Q[IlAW!ahhC2ac:9*A}h:p?([4%wOTJ%JR%cs";
const std::string kOther = "rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7";

mode_t mode_of(const fs::path& path) {
  struct stat status {};
  EXPECT_EQ(stat(path.c_str(), &status), 0);
  return status.st_mode & 0777;
}

TEST(KeyText, IsFortyCharactersThatStandForThirtyTwoBytes) {
  EXPECT_TRUE(is_key(kPublic));
  EXPECT_TRUE(is_key(std::string(40, '0')));
  for (const std::string& none :
       {std::string(), kPublic + "0", kPublic.substr(1), std::string(40, '"'),
        std::string(40, '#')}) {  // the last stands for too large a number
    EXPECT_FALSE(is_key(none)) << none;
  }
}

TEST(KeyName, IsShortAndPlain) {
  for (const char* name : {"a", "console-1", "OR_3.viewer"}) EXPECT_TRUE(is_key_name(name)) << name;
  for (const std::string& none : {std::string(), std::string("a b"), std::string(".hidden"),
                                  std::string("a/b"), std::string("ä"), std::string(65, 'a')}) {
    EXPECT_FALSE(is_key_name(none)) << none;
  }
}

class KeyFiles : public testing::Test {
 protected:
  fs::path secret(const std::string& text, mode_t mode = 0600) {
    const fs::path path = folder_.write("k.secret", text);
    EXPECT_EQ(chmod(path.c_str(), mode), 0);
    return path;
  }
  TemporaryFolder folder_;
};

TEST_F(KeyFiles, APairReadsBackAndItsSecretIsForTheOwnerAlone) {
  const auto files = value_or_fail(write_key_pair(folder_.path(), {"console", kPublic, kSecret}));
  EXPECT_EQ(mode_of(files.secret_file), 0600u);
  EXPECT_EQ(mode_of(files.public_file), 0644u);
  const auto pair = value_or_fail(read_secret_key(files.secret_file));
  EXPECT_EQ(pair.name, "console");
  EXPECT_EQ(pair.public_key, kPublic);
  EXPECT_EQ(pair.secret_key, kSecret);
  EXPECT_EQ(read_public_key(files.public_file).value(), kPublic);
  EXPECT_THAT(content_of(files.public_file), Not(HasSubstr(kSecret)));
  EXPECT_THAT(content_of(files.public_file), HasSubstr("PUBLIC"));
  EXPECT_THAT(content_of(files.secret_file), HasSubstr("SECRET"));
}

TEST_F(KeyFiles, NothingIsOverwritten) {
  for (const char* there : {"a.public", "a.secret"}) {
    fs::remove(folder_ / "a.public");
    fs::remove(folder_ / "a.secret");
    folder_.write(there, "mine");
    EXPECT_THAT(refusal_of(write_key_pair(folder_.path(), {"a", kPublic, kSecret}),
                           ErrorCode::kInvalidArgument),
                HasSubstr("exists already"));
    EXPECT_EQ(content_of(folder_ / there), "mine");
    EXPECT_EQ(folder_.entries(), 1u) << "the other half is not left behind";
  }
}

TEST_F(KeyFiles, ASecretThatOthersMayReadIsRefusedWithItsMode) {
  const std::string text = "name: a\npublic: " + kPublic + "\nsecret: " + kSecret + "\n";
  EXPECT_TRUE(read_secret_key(secret(text)));
  EXPECT_TRUE(read_secret_key(secret(text, 0400)));
  for (const mode_t mode : {0644, 0640, 0604, 0660, 0602, 0601}) {
    EXPECT_THAT(refusal_of(read_secret_key(secret(text, mode)), ErrorCode::kInvalidArgument),
                AllOf(HasSubstr("chmod 600"), Not(HasSubstr(kSecret))))
        << std::oct << mode;
  }
}

TEST_F(KeyFiles, WhatIsNoKeyFileIsRefusedWithItsLineAndWithoutItsSecret) {
  const auto read = [this](const std::string& text) {
    auto pair = read_secret_key(secret(text));
    if (!pair) {
      EXPECT_THAT(pair.error().message, Not(HasSubstr(kSecret)));
    }
    return pair;
  };
  expect_refused(read,
                 {{"", "has no line `name:`"},
                  {"name: a\n", "has no line `public:`"},
                  {"name: a\npublic: " + kPublic + "\n", "holds no secret key"},
                  {"name: a\npublic: short\n", "k.secret:2: public: is no name or key"},
                  {"name: a b\n", "k.secret:1: name: is no name or key"},
                  {"# comment\n\nname: a\nname: b\n", "k.secret:4: name: stands there twice"},
                  {"secret: " + kSecret + "x\n", "k.secret:1: secret: is no name or key"},
                  {"key = " + kSecret + "\n", "k.secret:1: must be"},
                  {kSecret + "\n", "k.secret:1: must be"}},
                 ErrorCode::kInvalidArgument);
  EXPECT_EQ(read_secret_key(folder_ / "absent").error().code, ErrorCode::kNotFound);
  EXPECT_FALSE(read_secret_key(folder_.path()));
}

TEST_F(KeyFiles, AnAllowListGrowsAndReadsBackInOrder) {
  const fs::path list = folder_ / "allow-list";
  const AllowedKey viewer{Role::kViewer, "wall", kPublic};
  const AllowedKey admin{Role::kAdmin, "console", kOther};
  ASSERT_TRUE(add_allowed_key(list, viewer));
  ASSERT_TRUE(add_allowed_key(list, admin));
  const auto keys = value_or_fail(read_allow_list(list));
  EXPECT_THAT(keys, ElementsAre(viewer, admin));
}

TEST_F(KeyFiles, ADuplicateIsNotAddedAndTheListStaysAsItWas) {
  const fs::path list = folder_.write("list", "viewer wall " + kPublic);  // no line feed at the end
  const std::string before = content_of(list);
  const AllowedKey twice[] = {{Role::kAdmin, "wall", kOther}, {Role::kAdmin, "other", kPublic}};
  for (const AllowedKey& key : twice) {
    EXPECT_THAT(refusal_of(add_allowed_key(list, key), ErrorCode::kInvalidArgument),
                HasSubstr("stands there already"));
    EXPECT_EQ(content_of(list), before);
  }
  ASSERT_TRUE(add_allowed_key(list, {Role::kAdmin, "other", kOther}));
  EXPECT_EQ(read_allow_list(list)->size(), 2u);
}

TEST_F(KeyFiles, ABadAllowListIsRefusedWithItsLine) {
  const auto read = [this](const std::string& text) {
    return read_allow_list(folder_.write("list", text));
  };
  expect_refused(
      read,
      {{"", "allows no key"},
       {"# only a comment\n", "allows no key"},
       {"viewer wall\n", "list:1: must be ROLE NAME PUBLICKEY"},
       {"root wall " + kPublic + "\n", "list:1: must be ROLE NAME PUBLICKEY"},
       {"viewer wall " + kPublic + " more\n", "list:1: must be ROLE NAME PUBLICKEY"},
       {"viewer a/b " + kPublic + "\n", "list:1: name:"},
       {"\nviewer wall short\n", "list:2: the key of wall is not a key"},
       {"viewer a " + kPublic + "\nadmin b " + kPublic + "\n", "list:2: the key of b stands there"},
       {"viewer a " + kPublic + "\nadmin a " + kOther + "\n", "list:2: the name a stands there"}},
      ErrorCode::kInvalidArgument);
}

TEST_F(KeyFiles, AnAllowListThatEverybodyMayChangeIsRefused) {
  const fs::path list = folder_.write("list", "viewer wall " + kPublic + "\n");
  ASSERT_EQ(chmod(list.c_str(), 0664), 0);
  EXPECT_THAT(refusal_of(read_allow_list(list), ErrorCode::kInvalidArgument),
              HasSubstr("mode 664: other accounts may change"));
  ASSERT_EQ(chmod(list.c_str(), 0666), 0);
  EXPECT_THAT(refusal_of(read_allow_list(list), ErrorCode::kInvalidArgument),
              HasSubstr("mode 666"));
}

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
}  // namespace brainshift::io
