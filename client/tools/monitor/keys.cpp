// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/monitor/keys.hpp"

#include <fmt/format.h>

#include <map>
#include <utility>

#include "common/io/files/file_access.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

// "SECRET" of the first line of a secret file, and so on.
bool says(const std::string& text, const std::string& word) {
  return text.substr(0, text.find('\n')).find(word) != std::string::npos;
}

Result<std::string> check_pair(const fs::path& file) {
  const auto pair = io::read_secret_key(file);
  if (!pair) return tl::unexpected(pair.error());
  if (public_key_of(pair->secret_key) != pair->public_key) {
    return io::invalid_file(file, "the public key does not belong to the secret one");
  }
  return fmt::format("{}: secret key of {}", file.string(), pair->name);
}

Result<std::string> check_list(const fs::path& file) {
  const auto keys = io::read_allow_list(file);
  if (!keys) return tl::unexpected(keys.error());
  std::map<Role, int> counts;
  for (const io::AllowedKey& key : *keys) ++counts[key.role];
  std::string text;
  for (const auto& [role, count] : counts) text += fmt::format(" {} {}", to_string(role), count);
  return fmt::format("{}: allow-list:{}", file.string(), text);
}

Result<std::string> check_file(const fs::path& file) {
  const auto text = io::read_file(file);
  if (!text) return tl::unexpected(text.error());
  if (says(*text, "SECRET")) return check_pair(file);
  if (says(*text, "allow-list")) return check_list(file);
  return io::read_public_key(file).map(
      [&](const std::string&) { return fmt::format("{}: public key", file.string()); });
}

}  // namespace

Result<io::KeyPairFiles> make_keys(const fs::path& folder, const std::string& name) {
  auto keys = new_keys();
  if (!keys) return tl::unexpected(keys.error());
  return io::write_key_pair(folder, {name, keys->public_key, keys->secret_key});
}

Result<NamedKey> named_key(const std::string& key_or_file) {
  if (io::is_key(key_or_file)) return NamedKey{{}, key_or_file};
  const fs::path file = key_or_file;
  return io::read_public_key(file).map([&](std::string key) {
    return NamedKey{file.stem().string(), std::move(key)};
  });
}

CheckedKeys check_key_files(const std::vector<fs::path>& files) {
  CheckedKeys checked;
  for (const fs::path& file : files) {
    auto line = check_file(file);
    if (line) {
      checked.good.push_back(std::move(*line));
    } else {
      checked.bad.push_back(line.error());
    }
  }
  return checked;
}

Result<std::optional<ClientKeys>> client_keys(const fs::path& server_key, const fs::path& key) {
  if (server_key.empty() && key.empty()) return std::nullopt;
  if (server_key.empty() || key.empty()) {
    return invalid("--server-key and --key need each other (see brainshift keys --help)");
  }
  auto server = io::read_public_key(server_key);
  if (!server) return tl::unexpected(server.error());
  auto own = io::read_secret_key(key);
  if (!own) return tl::unexpected(own.error());
  return ClientKeys{std::move(*server), std::move(own->public_key), std::move(own->secret_key)};
}

}  // namespace brainshift::client
