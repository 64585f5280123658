// SPDX-License-Identifier: GPL-3.0-or-later
// Files with CURVE keys: a key pair in two text files, and the allow-list of a daemon.
//
//   NAME.public   mode 0644   name: NAME          the half to hand out
//                             public: Z85 TEXT
//   NAME.secret   mode 0600   name: NAME          never leaves its machine
//                             public: Z85 TEXT
//                             secret: Z85 TEXT
//   allow-list                ROLE NAME Z85 TEXT  one key per line
//
// Lines that begin with # are comments. A key is 40 characters of Z85 (ZeroMQ RFC 32), which stand
// for 32 bytes. Every error is one line that names file and line, and never shows a secret.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.hpp"
#include "common/io/config/role.hpp"

namespace brainshift::io {

inline constexpr std::size_t kKeyCharacters = 40;
inline constexpr std::size_t kMaxKeyName = 64;

// 40 characters of the Z85 alphabet that stand for 32 bytes.
bool is_key(std::string_view text);
// 1 to 64 letters, digits, '-', '_' and '.', not beginning with '.'.
bool is_key_name(std::string_view name);

struct KeyPair {
  std::string name;
  std::string public_key;  // Z85
  std::string secret_key;  // Z85
};

struct KeyPairFiles {
  std::filesystem::path public_file;
  std::filesystem::path secret_file;
};

// NAME.public and NAME.secret in the folder, which must exist. Nothing is ever replaced.
// kInvalidArgument for a name or key that is none, and when a file is there already; kWriteFailed.
Result<KeyPairFiles> write_key_pair(const std::filesystem::path& folder, const KeyPair& pair);

// kNotFound, kUnreadable; kInvalidArgument for what is no such file, and for a file that accounts
// beside its owner may read or write.
Result<KeyPair> read_secret_key(const std::filesystem::path& path);
// The public key in a file of either kind. Of a secret file the secret is not looked at.
Result<std::string> read_public_key(const std::filesystem::path& path);

struct AllowedKey {
  Role role = Role::kViewer;
  std::string name;        // unique in its list
  std::string public_key;  // Z85; unique in its list

  bool operator==(const AllowedKey&) const = default;
};

// At least one key. kNotFound, kUnreadable; kInvalidArgument names the line, and is returned for a
// file that accounts beside its owner and group may write.
Result<std::vector<AllowedKey>> read_allow_list(const std::filesystem::path& path);

// Appends to the list, or makes it (mode 0644). kInvalidArgument when name or key stands there
// already, or is none; the list is unchanged then.
Status add_allowed_key(const std::filesystem::path& path, const AllowedKey& key);

}  // namespace brainshift::io
