// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/io/config/key_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <map>
#include <sstream>
#include <system_error>

#include "common/io/files/csv_numbers.hpp"
#include "common/io/files/descriptor.hpp"
#include "common/io/files/file_access.hpp"

namespace brainshift::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kZ85 =
    "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.-:+=^!/*?&<>()[]{}@%$#";

// Nobody needs a larger file; a list of a thousand keys has 100 KiB.
constexpr std::uintmax_t kMaxFileBytes = 1u << 20;

Status check_name(std::string_view name) {
  if (is_key_name(name)) return {};
  return invalid(
      fmt::format("name: must be 1 to {} letters, digits, '-', '_' or '.'", kMaxKeyName));
}

std::string mode_text(mode_t mode) { return fmt::format("{:o}", mode & 0777); }

// The file's text; refused when a bit of `forbidden` is set in its mode.
Result<std::string> read_guarded(const fs::path& path, mode_t forbidden,
                                 const std::string& complaint) {
  if (Status regular = check_regular_file(path); !regular) return tl::unexpected(regular.error());
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) {
    return unreadable(path, std::generic_category().message(errno));
  }
  if ((status.st_mode & forbidden) != 0) {
    return invalid_file(path, fmt::format("mode {}: {}", mode_text(status.st_mode), complaint));
  }
  if (static_cast<std::uintmax_t>(status.st_size) > kMaxFileBytes) {
    return invalid_file(path, "is too large for a file of keys");
  }
  return read_text(path);
}

tl::unexpected<Error> line_error(const fs::path& path, int line, const std::string& message) {
  return invalid(fmt::format("{}:{}: {}", path.string(), line, message));
}

// "name", "public" and perhaps "secret", each once.
Result<std::map<std::string, std::string>> key_fields(const fs::path& path,
                                                      const std::string& text) {
  std::map<std::string, std::string> fields;
  for (const auto& [number, line] : content_lines(text)) {
    const auto colon = line.find(": ");
    const std::string field = line.substr(0, colon);
    if (colon == std::string::npos || (field != "name" && field != "public" && field != "secret")) {
      return line_error(path, number, "must be `name:`, `public:` or `secret:` and a value");
    }
    const std::string value = line.substr(line.find_first_not_of(' ', colon + 1));
    const bool good = field == "name" ? is_key_name(value) : is_key(value);
    if (!good) return line_error(path, number, field + ": is no name or key");
    if (!fields.emplace(field, value).second) {
      return line_error(path, number, field + ": stands there twice");
    }
  }
  for (const char* needed : {"name", "public"}) {
    if (fields.count(needed) == 0) {
      return invalid_file(path, fmt::format("has no line `{}:`: is it a key file?", needed));
    }
  }
  return fields;
}

Status write_new(const fs::path& path, const std::string& text, mode_t mode) {
  const auto refuse = [&](int error) {
    if (error == EEXIST) {
      return invalid_file(path, "exists already, and keys are never overwritten");
    }
    return write_failed(path, std::generic_category().message(error));
  };
  Descriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode));
  if (file.get() < 0) return refuse(errno);
  // The umask may have taken bits away, which a public file needs; a secret file only loses some.
  const auto written = write(file.get(), text.data(), text.size());
  const bool complete = written == static_cast<ssize_t>(text.size()) &&
                        fchmod(file.get(), mode) == 0 && fsync(file.get()) == 0;
  const int error = complete ? 0 : errno;
  if (file.close() && complete) return {};
  unlink(path.c_str());
  return refuse(error);
}

std::string public_text(const KeyPair& pair) {
  return fmt::format(
      "# brainshift key, PUBLIC half: hand this file out.\n"
      "# A daemon's goes to its clients (--server-key). A client's goes into the daemon's\n"
      "# allow-list: brainshift keys add --allow FILE --role ROLE {}.public\n"
      "name: {}\npublic: {}\n",
      pair.name, pair.name, pair.public_key);
}

std::string secret_text(const KeyPair& pair) {
  return fmt::format(
      "# brainshift key, SECRET half: never leaves this machine, readable for its owner alone.\n"
      "# A daemon's is named by security.secret_key of its configuration, a client's by --key.\n"
      "name: {}\npublic: {}\nsecret: {}\n",
      pair.name, pair.public_key, pair.secret_key);
}

constexpr const char* kListHead =
    "# brainshift allow-list: who may talk to the daemon. One key per line: ROLE NAME PUBLICKEY\n"
    "# ROLE: viewer (look), source (and observe), owner (and start sessions), admin (and take "
    "over)\n"
    "# The daemon reads this file when it starts (docs/security.md).\n";

std::string list_line(const AllowedKey& key) {
  return fmt::format("{} {} {}\n", to_string(key.role), key.name, key.public_key);
}

// What stands in the way of both keys in one list; empty: nothing.
std::string conflict(const AllowedKey& one, const AllowedKey& other) {
  if (one.name == other.name) return fmt::format("the name {} stands there already", one.name);
  if (one.public_key == other.public_key) {
    return fmt::format("the key of {} stands there already, as {}", other.name, one.name);
  }
  return {};
}

Result<std::vector<AllowedKey>> parse_allow_list(const fs::path& path, const std::string& text) {
  std::vector<AllowedKey> keys;
  for (const auto& [number, line] : content_lines(text)) {
    std::istringstream words(line);
    std::string role;
    AllowedKey key;
    std::string surplus;
    words >> role >> key.name >> key.public_key;
    const bool complete = !words.fail() && !(words >> surplus);
    const auto known = role_from(role);
    if (!complete || !known) {
      return line_error(path, number,
                        "must be ROLE NAME PUBLICKEY with a role of viewer, source, owner, admin");
    }
    key.role = *known;
    if (Status name = check_name(key.name); !name) {
      return line_error(path, number, name.error().message);
    }
    if (!is_key(key.public_key)) {
      return line_error(path, number,
                        fmt::format("the key of {} is not a key: must be {} characters of Z85",
                                    key.name, kKeyCharacters));
    }
    for (const AllowedKey& earlier : keys) {
      if (const auto why = conflict(earlier, key); !why.empty()) {
        return line_error(path, number, why);
      }
    }
    keys.push_back(std::move(key));
  }
  return keys;
}

constexpr mode_t kBesideOwner = 077;
constexpr mode_t kOthersWrite = 02;
constexpr mode_t kForAll = 0644;
constexpr mode_t kForOwner = 0600;

Result<std::string> read_list_text(const fs::path& path) {
  return read_guarded(path, kOthersWrite, "every account may change the allow-list: chmod o-w it");
}

}  // namespace

bool is_key(std::string_view text) {
  if (text.size() != kKeyCharacters) return false;
  constexpr std::size_t kGroup = 5;  // characters for four bytes
  for (std::size_t begin = 0; begin < text.size(); begin += kGroup) {
    std::uint64_t value = 0;
    for (const char c : text.substr(begin, kGroup)) {
      const auto digit = kZ85.find(c);
      if (digit == std::string_view::npos) return false;
      value = value * kZ85.size() + digit;
    }
    if (value > UINT32_MAX) return false;
  }
  return true;
}

bool is_key_name(std::string_view name) {
  if (name.empty() || name.size() > kMaxKeyName || name.front() == '.') return false;
  return std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return c < 128 && (std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.');
  });
}

Result<KeyPairFiles> write_key_pair(const fs::path& folder, const KeyPair& pair) {
  if (Status name = check_name(pair.name); !name) return tl::unexpected(name.error());
  if (!is_key(pair.public_key) || !is_key(pair.secret_key)) {
    return invalid("a key must be 40 characters of Z85");
  }
  KeyPairFiles files{folder / (pair.name + ".public"), folder / (pair.name + ".secret")};
  if (Status secret = write_new(files.secret_file, secret_text(pair), kForOwner); !secret) {
    return tl::unexpected(secret.error());
  }
  if (Status open = write_new(files.public_file, public_text(pair), kForAll); !open) {
    unlink(files.secret_file.c_str());
    return tl::unexpected(open.error());
  }
  return files;
}

Result<KeyPair> read_secret_key(const fs::path& path) {
  auto fields = read_guarded(path, 0, {}).and_then([&](const std::string& text) {
    return key_fields(path, text);
  });
  if (!fields) return tl::unexpected(fields.error());
  if (fields->count("secret") == 0) {
    return invalid_file(path, "holds no secret key: it is the public half");
  }
  const auto guarded = read_guarded(
      path, kBesideOwner, "other accounts may use the secret key: chmod 600 it, or make a new one");
  if (!guarded) return tl::unexpected(guarded.error());
  return KeyPair{(*fields)["name"], (*fields)["public"], (*fields)["secret"]};
}

Result<std::string> read_public_key(const fs::path& path) {
  return read_guarded(path, 0, {})
      .and_then([&](const std::string& text) { return key_fields(path, text); })
      .map([](std::map<std::string, std::string> fields) { return fields["public"]; });
}

Result<std::vector<AllowedKey>> read_allow_list(const fs::path& path) {
  const auto text = read_list_text(path);
  if (!text) return tl::unexpected(text.error());
  auto keys = parse_allow_list(path, *text);
  if (keys && keys->empty()) {
    return invalid_file(path, "allows no key: add one with `brainshift keys add`");
  }
  return keys;
}

Status add_allowed_key(const fs::path& path, const AllowedKey& key) {
  if (Status name = check_name(key.name); !name) return name;
  if (!is_key(key.public_key)) {
    return invalid(
        fmt::format("the public key of {} must be {} characters of Z85", key.name, kKeyCharacters));
  }
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(path, ignored))) {
    return write_new(path, kListHead + list_line(key), kForAll);
  }
  const auto text = read_list_text(path);
  if (!text) return tl::unexpected(text.error());
  const auto keys = parse_allow_list(path, *text);
  if (!keys) return tl::unexpected(keys.error());
  for (const AllowedKey& earlier : *keys) {
    if (const auto why = conflict(earlier, key); !why.empty()) return invalid_file(path, why);
  }
  std::string extended = *text;
  if (!extended.empty() && extended.back() != '\n') extended += '\n';
  return write_file(path, extended + list_line(key));
}

}  // namespace brainshift::io
