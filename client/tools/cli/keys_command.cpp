// SPDX-License-Identifier: GPL-3.0-or-later
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/tools/cli/command.hpp"
#include "client/tools/monitor/keys.hpp"

namespace brainshift::client {
namespace {

namespace fs = std::filesystem;

struct KeysArguments {
  std::string name;
  fs::path folder = ".";
  fs::path allow_list;
  std::string role = "viewer";
  std::string key;
  std::vector<fs::path> files;
};

Status make(const KeysArguments& arguments) {
  const auto files = make_keys(arguments.folder, arguments.name);
  if (!files) return tl::unexpected(files.error());
  std::printf("%s   public: hand it out\n%s   secret: stays on this machine\n",
              files->public_file.c_str(), files->secret_file.c_str());
  return {};
}

Status add(const KeysArguments& arguments) {
  const auto key = named_key(arguments.key);
  if (!key) return tl::unexpected(key.error());
  const io::AllowedKey allowed{*role_from(arguments.role),
                               arguments.name.empty() ? key->name : arguments.name,
                               key->public_key};
  if (allowed.name.empty()) {
    return fail(ErrorCode::kInvalidArgument,
                "keys add: --name is needed for a key that is no file");
  }
  if (Status added = io::add_allowed_key(arguments.allow_list, allowed); !added) return added;
  std::printf("%s: %s may act as %s from the daemon's next start\n", arguments.allow_list.c_str(),
              allowed.name.c_str(), arguments.role.c_str());
  return {};
}

Status list(const KeysArguments& arguments) {
  const auto keys = io::read_allow_list(arguments.allow_list);
  if (!keys) return tl::unexpected(keys.error());
  for (const io::AllowedKey& key : *keys) {
    const std::string role(to_string(key.role));
    std::printf("%-7s %-20s %s\n", role.c_str(), key.name.c_str(), key.public_key.c_str());
  }
  return {};
}

// Every file is reported; the first bad one decides how the command ends.
Status check_keys(const KeysArguments& arguments) {
  const CheckedKeys checked = check_key_files(arguments.files);
  for (const std::string& line : checked.good) std::puts(line.c_str());
  for (std::size_t i = 1; i < checked.bad.size(); ++i) print_error(checked.bad[i].message);
  if (checked.bad.empty()) return {};
  return tl::unexpected(checked.bad.front());
}

std::vector<std::string> role_words() {
  std::vector<std::string> words;
  for (const Role role : kAllRoles) words.emplace_back(to_string(role));
  return words;
}

using Action = Status (*)(const KeysArguments&);

CLI::App* add_keys_action(CLI::App& keys, const std::string& name, const std::string& text,
                          const std::shared_ptr<KeysArguments>& arguments, Action run,
                          Status& status) {
  CLI::App* action = keys.add_subcommand(name, text);
  action->callback([arguments, run, &status] { status = run(*arguments); });
  return action;
}

}  // namespace

void add_keys(CLI::App& app, Status& status) {
  auto arguments = std::make_shared<KeysArguments>();
  CLI::App* keys = app.add_subcommand(
      "keys", "Make and check the keys of daemons and clients (docs/security.md).");
  keys->require_subcommand(1);
  keys->footer(
      "The whole set-up. On the daemon's machine, then on a client's, then on the daemon's again:\n"
      "  brainshift keys make daemon\n"
      "  brainshift keys make console        (and bring console.public to the daemon's machine)\n"
      "  brainshift keys add --allow allow-list --role owner console.public\n"
      "In the daemon's configuration, and then on the client with daemon.public:\n"
      "  security: { secret_key: daemon.secret, allow_list: allow-list }\n"
      "  brainshift replay S.surgery --endpoint tcp://HOST:5555 --server-key daemon.public --key "
      "console.secret --report r.json\n"
      "Roles: viewer looks; source also hands in observations; owner also starts sessions; admin "
      "also takes over.\n"
      "Each has a --help of its own.");

  CLI::App* action = add_keys_action(*keys, "make", "Make a key pair: NAME.public and NAME.secret.",
                                     arguments, make, status);
  action->add_option("name", arguments->name, "of the machine or program")->required();
  action->add_option("--dir", arguments->folder, "folder for the files")->capture_default_str();
  action->footer(
      "Nothing is overwritten. The secret file is for its owner alone (mode 0600).\n"
      "Example:\n  brainshift keys make console --dir ~/.config/brainshift");

  action = add_keys_action(*keys, "add", "Add a public key to a daemon's allow-list.", arguments,
                           add, status);
  action->add_option("key", arguments->key, "a .public file, or its 40 characters")->required();
  action->add_option("--allow", arguments->allow_list, "allow-list; made if it does not exist")
      ->required();
  action->add_option("--role", arguments->role, "what its holder may do")
      ->check(CLI::IsMember(role_words()))
      ->required();
  action->add_option("--name", arguments->name,
                     "under which the daemon knows it; the file's name by default");
  action->footer(
      "The daemon reads its list when it starts. To take a key away, delete its line.\n"
      "Example:\n  brainshift keys add --allow allow-list --role source ultrasound.public");

  action = add_keys_action(*keys, "list", "Print an allow-list.", arguments, list, status);
  action->add_option("--allow", arguments->allow_list, "allow-list")->required();
  action->footer("Example:\n  brainshift keys list --allow allow-list");

  action = add_keys_action(*keys, "check", "Check permissions, format and duplicates of files.",
                           arguments, check_keys, status);
  action->add_option("files", arguments->files, "key files and allow-lists")->required();
  action->footer("Example:\n  brainshift keys check daemon.secret allow-list");
}

}  // namespace brainshift::client
