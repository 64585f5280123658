// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/faults/daemon_process.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "common/io/config/key_file.hpp"
#include "tests/faults/process.hpp"
#include "tests/faults/settings.hpp"

extern char** environ;

namespace brainshift::faults {
namespace {

namespace fs = std::filesystem;

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (std::string& text : texts) result.push_back(text.data());
  result.push_back(nullptr);
  return result;
}

std::string proc_file(pid_t pid, const char* name) {
  return "/proc/" + std::to_string(pid) + "/" + name;
}

double status_number(pid_t pid, const std::string& key) {
  std::ifstream stream(proc_file(pid, "status"));
  for (std::string line; std::getline(stream, line);) {
    if (line.rfind(key, 0) == 0) return std::stod(line.substr(key.size()));
  }
  throw std::runtime_error("brainshiftd has ended");
}

// Key pairs of the daemon and of an admin, and the allow-list that names the admin.
client::ClientKeys make_keys(const fs::path& folder) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  const auto pair = [&](const char* name) {
    const auto made = need(client::new_keys(), "keys");
    io::KeyPair keys{name, made.public_key, made.secret_key};
    need(io::write_key_pair(folder, keys), "keys");
    return keys;
  };
  const io::KeyPair daemon = pair("daemon"), admin = pair("admin");
  need(io::add_allowed_key(folder / "allow-list", {Role::kAdmin, admin.name, admin.public_key}),
       "allow-list");
  return {daemon.public_key, admin.public_key, admin.secret_key};
}

fs::path write_configuration(const DaemonOptions& options) {
  const fs::path file = options.folder / "daemon.yaml";
  std::ofstream stream(file);
  stream << "endpoint: " << options.endpoint << "\nmax_clients: " << options.max_clients << "\n";
  if (options.journal) {
    fs::create_directories(options.folder / "journal");
    stream << "journal_dir: " << fs::absolute(options.folder / "journal").string() << "\n";
  }
  stream << options.more;
  if (options.keys) {
    const std::string keys = fs::absolute(options.folder / "keys").string();
    stream << "security: {secret_key: " << keys << "/daemon.secret, allow_list: " << keys
           << "/allow-list}\n";
  }
  stream.close();
  if (!stream) throw std::runtime_error("cannot write " + file.string());
  return file;
}

// Between fork and exec: nothing but system calls.
[[noreturn]] void become(char* const* arguments, char* const* environment, int out, int log,
                         int max_descriptors) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  dup2(out, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  if (max_descriptors > 0) {
    const auto most = static_cast<rlim_t>(max_descriptors);
    const rlimit limit{most, most};
    setrlimit(RLIMIT_NOFILE, &limit);
  }
  execve(arguments[0], arguments, environment);
  _exit(127);
}

std::string first_line(int fd) {
  std::string text;
  std::array<char, 256> buffer{};
  while (text.find('\n') == std::string::npos) {
    const ssize_t count = read(fd, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
  return text.substr(0, text.find('\n'));
}

}  // namespace

DaemonProcess::DaemonProcess(const DaemonOptions& options) : options_(options) {
  if (options.keys) keys_ = make_keys(options.folder / "keys");
  const auto begin = std::chrono::steady_clock::now();
  std::vector<std::string> arguments = {
      brainshiftd(), "serve", "--config", write_configuration(options), "--model", options.model};
  std::vector<std::string> environment;
  for (char** each = environ; *each != nullptr; ++each) environment.emplace_back(*each);
  environment.insert(environment.end(), options.environment.begin(), options.environment.end());
  const auto argv = pointers(arguments), envp = pointers(environment);
  const std::string log_file = options.log ? options.folder / "daemon.log" : fs::path("/dev/null");
  const int log = open(log_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  std::array<int, 2> out{};
  if (log < 0 || pipe2(out.data(), O_CLOEXEC) != 0) {
    throw std::system_error(errno, std::generic_category(), log_file);
  }
  pid_ = fork();
  if (pid_ == 0) become(argv.data(), envp.data(), out[1], log, options.max_descriptors);
  close(out[1]);
  close(log);
  stdout_fd_ = out[0];
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  const std::string line = first_line(stdout_fd_);
  const std::string words = "listening on ";
  if (line.rfind(words, 0) != 0) {
    end(SIGKILL);
    throw std::runtime_error("brainshiftd did not start; see " + log_file);
  }
  endpoint_ = line.substr(words.size());
  listening_after_s_ =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

DaemonProcess::~DaemonProcess() {
  if (pid_ > 0) end(SIGKILL);
  if (stdout_fd_ >= 0) close(stdout_fd_);
}

bool DaemonProcess::runs() const {
  if (pid_ <= 0) return false;
  siginfo_t info{};
  // Leaves an ended child to be waited for.
  return waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid == 0;
}

int DaemonProcess::end(int signal) {
  if (pid_ <= 0) return -1;
  kill(pid_, signal);
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

double DaemonProcess::resident_mib() const { return status_number(pid_, "VmRSS:") / 1024.0; }

int DaemonProcess::threads() const { return static_cast<int>(status_number(pid_, "Threads:")); }

double DaemonProcess::cpu_s() const {
  std::ifstream stream(proc_file(pid_, "stat"));
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  // The name in parentheses may hold blanks; user and system time are the 12th and 13th after it.
  std::istringstream words(text.substr(text.rfind(')') + 1));
  std::vector<std::string> fields{std::istream_iterator<std::string>(words), {}};
  if (fields.size() < 13) throw std::runtime_error("brainshiftd has ended");
  return (std::stod(fields[11]) + std::stod(fields[12])) /
         static_cast<double>(sysconf(_SC_CLK_TCK));
}

int DaemonProcess::descriptors() const {
  const fs::directory_iterator entries(proc_file(pid_, "fd"));
  return static_cast<int>(std::distance(fs::begin(entries), fs::end(entries)));
}

std::vector<fs::path> journals_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".surgery") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace brainshift::faults
