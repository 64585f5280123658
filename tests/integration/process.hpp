// SPDX-License-Identifier: GPL-3.0-or-later
// Programs run as children, with what they print.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace brainshift::integration {

struct Finished {
  int exit_status = -1;  // -1: ended by a signal, or did not end in time and was killed
  std::string out;
  std::string err;
};

// argv[0] is the program. Kills it after limit_s, ten times that with sanitizers.
Finished run(const std::vector<std::string>& argv, double limit_s = 120.0);

// A program that keeps running until told to end.
class Background {
 public:
  // Starts it and reads stdout up to the end of the first line; stderr goes to the given file.
  Background(const std::vector<std::string>& argv, const std::string& stderr_file);
  ~Background();  // kills it if it still runs
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  const std::string& first_line() const { return first_line_; }  // without the line feed
  // Sends the signal and waits for the end; the exit status, or -1.
  int end(int signal);

 private:
  pid_t pid_ = -1;
  int stdout_fd_ = -1;
  std::string first_line_;
};

// The lines of a text, without line feeds.
std::vector<std::string> lines(const std::string& text);

}  // namespace brainshift::integration
