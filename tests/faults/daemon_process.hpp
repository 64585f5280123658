// SPDX-License-Identifier: GPL-3.0-or-later
// The real daemon as a child process: started, looked at from outside, killed.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/client_keys.hpp"

namespace brainshift::faults {

struct DaemonOptions {
  std::filesystem::path model;
  std::filesystem::path folder;  // for its configuration and its log; exists
  bool journal = false;          // keeps one in folder/journal, which is made
  bool keys = false;             // asks for keys, which are made in folder/keys
  std::string endpoint = "tcp://127.0.0.1:*";
  int max_clients = 64;
  bool log = true;                            // into folder/daemon.log; false: nowhere
  int max_descriptors = 0;                    // RLIMIT_NOFILE; 0: as this process has it
  std::vector<std::string> environment = {};  // "NAME=value", beside this process's own
  std::string more = {};                      // lines of its configuration
};

// One thread at a time. The daemon ends with this object, and with the thread that started it.
class DaemonProcess {
 public:
  // Returns when it says "listening on"; throws std::runtime_error when it ends before.
  explicit DaemonProcess(const DaemonOptions& options);
  ~DaemonProcess();
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  const std::string& endpoint() const { return endpoint_; }
  // Of its one client, an admin; none when it asks for none.
  const std::optional<client::ClientKeys>& keys() const { return keys_; }
  double listening_after_s() const { return listening_after_s_; }
  std::filesystem::path journal() const { return options_.folder / "journal"; }
  pid_t pid() const { return pid_; }

  bool runs() const;
  // Sends the signal and waits; the exit status, or -1 when a signal ended it.
  int end(int signal);

  double resident_mib() const;
  double cpu_s() const;  // used so far, all threads
  int descriptors() const;
  int threads() const;

 private:
  DaemonOptions options_;
  std::optional<client::ClientKeys> keys_;
  pid_t pid_ = -1;
  int stdout_fd_ = -1;
  std::string endpoint_;
  double listening_after_s_ = 0.0;
};

// The surgery files of a folder, oldest name first.
std::vector<std::filesystem::path> journals_in(const std::filesystem::path& folder);

}  // namespace brainshift::faults
