// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/faults/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <system_error>

extern char** environ;

namespace brainshift::faults {
namespace {

using Clock = std::chrono::steady_clock;

struct Pipe {
  int read_end = -1, write_end = -1;
};

Pipe make_pipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw std::system_error(errno, std::generic_category(), "pipe2");
  }
  return {ends[0], ends[1]};
}

pid_t spawn(const std::vector<std::string>& argv, posix_spawn_file_actions_t& actions) {
  std::vector<char*> arguments;
  for (const std::string& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  pid_t pid = -1;
  const int error = posix_spawn(&pid, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::system_error(error, std::generic_category(), argv[0]);
  return pid;
}

int wait_for(pid_t pid) {
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// Appends what is there; false at the end of the stream.
bool read_some(int fd, std::string& text) {
  std::array<char, 4096> buffer{};
  const ssize_t count = read(fd, buffer.data(), buffer.size());
  if (count > 0) text.append(buffer.data(), static_cast<std::size_t>(count));
  return count > 0;
}

}  // namespace

std::string brainshiftd() { return BRAINSHIFTD; }
std::string brainshift() { return BRAINSHIFT; }

Finished run(const std::vector<std::string>& argv, double limit_s) {
  const Pipe out = make_pipe();
  const Pipe err = make_pipe();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, out.write_end, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.write_end, STDERR_FILENO);
  const pid_t pid = spawn(argv, actions);
  close(out.write_end);
  close(err.write_end);

  Finished finished;
  std::array<pollfd, 2> streams = {pollfd{out.read_end, POLLIN, 0},
                                   pollfd{err.read_end, POLLIN, 0}};
  const auto deadline =
      Clock::now() + std::chrono::duration<double>(BRAINSHIFT_TIMEOUT_FACTOR * limit_s);
  while (streams[0].fd >= 0 || streams[1].fd >= 0) {
    const auto left = std::chrono::duration<double, std::milli>(deadline - Clock::now()).count();
    if (left <= 0.0 || poll(streams.data(), streams.size(), static_cast<int>(left) + 1) == 0) {
      kill(pid, SIGKILL);
      break;
    }
    // A negative descriptor is skipped by poll.
    if (streams[0].revents != 0 && !read_some(out.read_end, finished.out)) streams[0].fd = -1;
    if (streams[1].revents != 0 && !read_some(err.read_end, finished.err)) streams[1].fd = -1;
  }
  close(out.read_end);
  close(err.read_end);
  finished.exit_status = wait_for(pid);
  return finished;
}

}  // namespace brainshift::faults
