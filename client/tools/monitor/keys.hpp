// SPDX-License-Identifier: GPL-3.0-or-later
// What `brainshift keys` does, and how a command gets the keys that it talks to a daemon with.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/client_keys.hpp"
#include "common/core/error.hpp"
#include "common/io/config/key_file.hpp"

namespace brainshift::client {

// A new key pair in the folder: NAME.public and NAME.secret. Nothing is replaced.
// kInvalidArgument, kWriteFailed.
Result<io::KeyPairFiles> make_keys(const std::filesystem::path& folder, const std::string& name);

// A key as the command line names it: 40 characters, or a file that holds a public key.
// kInvalidArgument, kNotFound, kUnreadable.
struct NamedKey {
  std::string name;  // of the file's pair; empty for bare characters
  std::string public_key;
};
Result<NamedKey> named_key(const std::string& key_or_file);

// What is wrong with files of keys and allow-lists, all of them in one sentence each; and a line
// for each good one. A file is taken for what its first line says.
struct CheckedKeys {
  std::vector<std::string> good;
  std::vector<Error> bad;
};
CheckedKeys check_key_files(const std::vector<std::filesystem::path>& files);

// From the files of --server-key and --key; nullopt when neither is given. kInvalidArgument when
// only one is; the errors of io::read_public_key and io::read_secret_key.
Result<std::optional<ClientKeys>> client_keys(const std::filesystem::path& server_key,
                                              const std::filesystem::path& key);

}  // namespace brainshift::client
