// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/monitor/top.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <algorithm>
#include <cerrno>
#include <string_view>
#include <utility>
#include <vector>

#include "client/lib/client.hpp"
#include "client/tools/monitor/page.hpp"
#include "common/io/files/stop_signals.hpp"

namespace brainshift::client {
namespace {

using Clock = std::chrono::steady_clock;

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

// The first `columns` characters.
std::string_view fitting(std::string_view text, int columns) {
  std::size_t end = 0;
  for (int column = 0; end < text.size() && column < columns; ++column) {
    ++end;
    while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xc0u) == 0x80u) ++end;
  }
  return text.substr(0, end);
}

// The alternate screen without a cursor, and keys as they are typed; put back at the end.
class Screen {
 public:
  Screen(int input, int output) : input_(input), output_(output) {
    keys_ = tcgetattr(input_, &before_) == 0;
    if (keys_) {
      termios raw = before_;
      raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
      tcsetattr(input_, TCSANOW, &raw);
    }
    write_all(output_, "\033[?1049h\033[?25l");
  }
  ~Screen() {
    write_all(output_, "\033[?25h\033[?1049l");
    if (keys_) tcsetattr(input_, TCSANOW, &before_);
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  bool keys() const { return keys_; }
  bool draw(const std::vector<Line>& lines) const {
    winsize size{};
    const bool known = ioctl(output_, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && size.ws_row > 0;
    const int columns = known ? size.ws_col : 1000;
    const std::size_t rows = known ? size.ws_row : lines.size() + 1;
    std::string text = "\033[H";
    for (std::size_t i = 0; i < std::min(lines.size(), rows - 1); ++i) {
      const std::string_view shown = fitting(lines[i].text, columns);
      if (lines[i].alarm) text += "\033[1;31m";
      text += shown;
      if (lines[i].alarm) text += "\033[0m";
      text += "\033[K\r\n";
    }
    return write_all(output_, text + "\033[J");
  }

 private:
  int input_;
  int output_;
  bool keys_ = false;
  termios before_{};
};

// Waits for q or a signal until then, and looks at least once: a question may have taken longer
// than that. input: -1 for one without keys.
bool quits(const io::StopSignals& signals, int input, Clock::time_point until) {
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
    pollfd items[] = {{signals.fd(), POLLIN, 0}, {input, POLLIN, 0}};
    const int ready = poll(items, 2, static_cast<int>(std::max<long>(0, left)));
    if (ready > 0 && items[0].revents != 0) return true;
    char typed = 0;
    if (ready > 0 && (read(input, &typed, 1) != 1 || typed == 'q' || typed == 'Q')) return true;
    if (left <= 0) return false;
  }
}

class TopView {
 public:
  TopView(Client client, const TopOptions& options)
      : client_(std::move(client)), options_(options) {}

  // Asks once more.
  Status ask() {
    auto report = client_.report();
    if (!report) {
      failure_ = report.error().message;
      return tl::unexpected(report.error());
    }
    failure_.clear();
    answered_ = Clock::now();
    reports_.before = has_report_ ? std::optional(std::move(reports_.now)) : std::nullopt;
    reports_.now = std::move(*report);
    has_report_ = true;
    return {};
  }

  std::vector<Line> lines() const {
    std::vector<Line> lines;
    if (!failure_.empty()) lines.push_back({"STALE: " + silence(), true});
    if (!has_report_) return lines;
    for (Line& line : page(reports_, options_.endpoint)) lines.push_back(std::move(line));
    return lines;
  }

  std::string line() const { return failure_.empty() ? summary(reports_) : "STALE: " + silence(); }

 private:
  std::string silence() const {
    if (!has_report_) return failure_;
    const double seconds = std::chrono::duration<double>(Clock::now() - answered_).count();
    return fmt::format("no answer for {} ({})", duration_text(seconds), failure_);
  }

  Client client_;
  const TopOptions& options_;
  Reports reports_;
  bool has_report_ = false;
  std::string failure_;  // of the last question; empty: it was answered
  Clock::time_point answered_ = {};
};

Status print_once(TopView& view, const TopOptions& options, const io::StopSignals& signals) {
  if (Status ok = view.ask(); !ok) return ok;
  if (quits(signals, -1, Clock::now() + options.interval)) return {};
  if (Status ok = view.ask(); !ok) return ok;
  std::string text;
  for (const Line& line : view.lines()) text += line.text + "\n";
  write_all(options.output, text);
  return {};
}

}  // namespace

Status top(const TopOptions& options) {
  auto client = Client::connect(
      options.endpoint, {.request_timeout = std::chrono::milliseconds(1000), .keys = options.keys});
  if (!client) return tl::unexpected(client.error());
  const auto signals = io::StopSignals::catch_all();
  if (!signals) return tl::unexpected(signals.error());
  TopView view(std::move(*client), options);
  if (options.once) return print_once(view, options, *signals);
  std::optional<Screen> screen;
  if (isatty(options.output) != 0) screen.emplace(options.input, options.output);
  while (true) {
    const Clock::time_point begun = Clock::now();
    static_cast<void>(view.ask());  // what is wrong is shown
    if (signals->arrived()) return {};
    const bool shown =
        screen ? screen->draw(view.lines()) : write_all(options.output, view.line() + "\n");
    if (!shown) return {};
    const int keys = screen && screen->keys() ? options.input : -1;
    if (quits(*signals, keys, begun + options.interval)) return {};
  }
}

}  // namespace brainshift::client
