// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/monitor/keys.hpp"

#include <gmock/gmock.h>

#include "tests/support/results.hpp"
#include "tests/support/temporary_folder.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;
using test_support::content_of;
using test_support::TemporaryFolder;
using testing::HasSubstr;
using testing::SizeIs;

class Keys : public testing::Test {
 protected:
  io::KeyPairFiles made(const std::string& name) {
    return value_or_fail(make_keys(folder_.path(), name));
  }
  TemporaryFolder folder_;
};

TEST_F(Keys, EveryPairIsAnotherAndGood) {
  const auto a = made("a");
  const auto b = made("b");
  EXPECT_NE(io::read_public_key(a.public_file).value(), io::read_public_key(b.public_file).value());
  const CheckedKeys checked =
      check_key_files({a.public_file, a.secret_file, b.public_file, b.secret_file});
  EXPECT_THAT(checked.good, SizeIs(4));
  EXPECT_TRUE(checked.bad.empty());
}

TEST_F(Keys, ACheckReportsEveryBadFile) {
  const auto a = made("a");
  const auto b = made("b");
  std::string mixed = content_of(a.secret_file);
  const std::string own = io::read_public_key(a.public_file).value();
  mixed.replace(mixed.find(own), own.size(), io::read_public_key(b.public_file).value());
  const fs::path wrong = folder_.write("mixed", mixed);
  fs::permissions(wrong, fs::perms::owner_read);
  fs::permissions(b.secret_file, fs::perms::all);
  const CheckedKeys checked = check_key_files({wrong, b.secret_file, a.secret_file});
  EXPECT_THAT(checked.good, SizeIs(1));
  ASSERT_THAT(checked.bad, SizeIs(2));
  EXPECT_THAT(checked.bad[0].message, HasSubstr("does not belong"));
  EXPECT_THAT(checked.bad[1].message, HasSubstr("mode 777"));
}

TEST_F(Keys, AKeyIsNamedByItsCharactersOrItsFile) {
  const auto a = made("console");
  const std::string key = io::read_public_key(a.public_file).value();
  EXPECT_EQ(named_key(key)->public_key, key);
  EXPECT_EQ(named_key(a.public_file.string())->public_key, key);
  EXPECT_EQ(named_key(a.public_file.string())->name, "console");
  EXPECT_EQ(named_key((folder_ / "absent").string()).error().code, ErrorCode::kNotFound);
}

TEST_F(Keys, ACommandTakesBothFilesOrNone) {
  const auto daemon = made("daemon");
  const auto own = made("console");
  EXPECT_FALSE(client_keys({}, {})->has_value());
  const auto keys = value_or_fail(client_keys(daemon.public_file, own.secret_file));
  EXPECT_EQ(keys->server_public_key, io::read_public_key(daemon.public_file).value());
  EXPECT_EQ(keys->public_key, io::read_public_key(own.public_file).value());
  EXPECT_THAT(client_keys(daemon.public_file, {}).error().message, HasSubstr("need each other"));
  EXPECT_THAT(client_keys({}, own.secret_file).error().message, HasSubstr("need each other"));
  EXPECT_THAT(client_keys(daemon.public_file, own.public_file).error().message,
              HasSubstr("no secret key"));
}

}  // namespace
}  // namespace brainshift::client
