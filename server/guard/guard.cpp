// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/guard/guard.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <map>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "server/guard/connection.hpp"
#include "server/guard/sheltered.hpp"

namespace brainshift::server {
namespace {

using Clock = std::chrono::steady_clock;

// Reads of one connection before the others get their turn.
constexpr int kReadsPerTurn = 16;
constexpr std::chrono::milliseconds kTick{100};
// Beyond one message; what a busy client has under way.
constexpr std::size_t kSlack = 1u << 20;
// Messages of a connection that libzmq may hold before it is read again. Each may keep one of
// libzmq's buffers of 18 KiB, however short it is; not with CURVE, where parts are counted and a
// message may have some.
constexpr std::uint64_t kMaxWaiting = 8;
constexpr std::uint64_t kMaxWaitingParts = 64;

}  // namespace

struct Guard::Impl {
  Impl(Listener given, std::string inner_name, const GuardOptions& given_options)
      : listener(std::move(given)), inner(std::move(inner_name)), options(given_options) {
    options.held_bytes = std::max(options.held_bytes, 2 * options.max_message_bytes + 2 * kSlack);
    epoll = epoll_create1(EPOLL_CLOEXEC);
    wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (epoll < 0 || wake < 0) throw std::system_error(errno, std::generic_category(), "epoll");
    watch(wake, EPOLLIN, EPOLL_CTL_ADD);
    watch(listener.fd(), EPOLLIN, EPOLL_CTL_ADD);
  }

  ~Impl() {
    connections.clear();
    ::close(epoll);
    ::close(wake);
  }

  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void watch(int fd, std::uint32_t events, int operation) const {
    epoll_event event{};
    event.events = events;
    event.data.fd = fd;
    epoll_ctl(epoll, operation, fd, &event);
  }

  void work() {
    std::array<epoll_event, 64> events{};
    auto next_tick = Clock::now() + kTick;
    while (!stopping) {
      // Nobody connected: nothing to look after.
      const int wait = connections.empty() && listening ? -1 : static_cast<int>(kTick.count());
      const int count = epoll_wait(epoll, events.data(), static_cast<int>(events.size()), wait);
      for (int i = 0; i < count; ++i) {
        const epoll_event& event = events[static_cast<std::size_t>(i)];
        const int fd = event.data.fd;
        if (fd == wake) {
          std::uint64_t value = 0;
          [[maybe_unused]] const auto got = read(wake, &value, sizeof value);
          next_tick = Clock::now();
        } else if (fd == listener.fd()) {
          if (!sheltered("a connection", [&] { accept_all(); })) listen_again(false);
        } else if (const auto found = by_fd.find(fd); found != by_fd.end()) {
          Connection& connection = *found->second;
          const bool hung_up = (event.events & (EPOLLHUP | EPOLLERR)) != 0;
          if (!sheltered("a connection", [&] { serve(connection, hung_up); })) close_fd(fd);
        }
      }
      if (Clock::now() >= next_tick) {
        sheltered("a look at the connections", [&] { tick(); });
        next_tick = Clock::now() + kTick;
      }
    }
  }

  // Of a connection that could not be served, if it is still there.
  void close_fd(int fd) {
    if (const auto found = by_fd.find(fd); found != by_fd.end()) end(*found->second, nullptr, {});
  }

  void nudge() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = write(wake, &one, sizeof one);
  }

  void accept_all() {
    // Not all at once: those that are connected get their turn.
    for (int i = 0; i < 16; ++i) {
      if (!make_room()) return listen_again(false);  // they wait in the kernel's queue
      const int peer = accept4(listener.fd(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (peer < 0) {
        if (errno == EMFILE || errno == ENFILE || errno == ENOMEM || errno == ENOBUFS) {
          listen_again(false);  // until the next tick
        }
        return;
      }
      open(peer);
    }
  }

  // Whether one more connection may be had. A newcomer has a tick to say something, and libzmq that
  // time to close what it had of the one that makes room: its descriptors must not pile up.
  bool make_room() {
    if (connections.size() < static_cast<std::size_t>(options.max_connections)) return true;
    Connection* oldest = nullptr;
    for (const auto& [name, connection] : connections) {
      if (connection->account->served) continue;
      if (oldest == nullptr || connection->opened < oldest->opened) oldest = connection.get();
    }
    if (oldest == nullptr || Clock::now() - oldest->opened < kTick) return false;
    end(*oldest, &counts.closed_for_room, "room is needed");
    return true;
  }

  void open(int peer) {
    std::unique_ptr<Connection> connection;
    try {
      connection = std::make_unique<Connection>(
          ZmtpStream::Bounds{.message_bytes = options.max_message_bytes + kWrapping}, Clock::now());
    } catch (...) {
      ::close(peer);
      throw;
    }
    connection->peer = peer;
    connection->inner = connect_inner(inner);
    if (connection->inner < 0) return;  // closes it
    const int yes = 1;
    setsockopt(peer, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);  // fails for ipc, which has none
    connection->name = socket_name(connection->inner, &getsockname);
    Connection& added = *connection;
    connections[added.name] = std::move(connection);
    try {
      by_fd[added.peer] = by_fd[added.inner] = &added;
      const std::lock_guard lock(mutex);
      accounts[added.name] = added.account;
      ++counts.accepted;
    } catch (...) {
      end(added, nullptr, {});
      throw;
    }
    watch(added.peer, EPOLLIN, EPOLL_CTL_ADD);
    watch(added.inner, EPOLLIN, EPOLL_CTL_ADD);
  }

  // hung_up: an end has gone; what it left is passed on, if the other end takes it.
  void serve(Connection& connection, bool hung_up) {
    if (!pump(connection, connection.down, connection.inner, connection.peer)) return;
    if (!pump(connection, connection.up, connection.peer, connection.inner)) return;
    if (hung_up && connection.stuck()) return end(connection, nullptr, {});
    const auto interest = [](bool in, bool out) {
      return (in ? static_cast<std::uint32_t>(EPOLLIN) : 0u) |
             (out ? static_cast<std::uint32_t>(EPOLLOUT) : 0u);
    };
    const bool read_peer = connection.up.empty() && !connection.account->throttled;
    watch(connection.peer, interest(read_peer, !connection.down.empty()), EPOLL_CTL_MOD);
    watch(connection.inner, interest(connection.down.empty(), !connection.up.empty()),
          EPOLL_CTL_MOD);
  }

  // Passes bytes on in one direction: writes out what the lane holds, as far as the socket takes
  // it, then reads into it; up, to libzmq, within the bounds. False when the connection has ended.
  bool pump(Connection& connection, Lane& lane, int from, int to) {
    const bool up = &lane == &connection.up;
    const auto gone = [&] {
      end(connection, nullptr, {});
      return false;
    };
    for (int i = 0; i < kReadsPerTurn; ++i) {
      bool more = true;
      if (up) {
        connection.account->throttled = true;  // first: delivered() sees it, or has been seen
        const auto now = Clock::now();
        held += connection.settle(now);
        more =
            connection.to_read.has_one(now) &&
            connection.held <= options.max_message_bytes + kSlack &&
            connection.waiting <= (connection.stream.encrypted() ? kMaxWaitingParts : kMaxWaiting);
        connection.account->throttled = !more;
      }
      while (!lane.empty()) {
        const auto sent = send(to, &lane.bytes[lane.begin], lane.end - lane.begin, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR) continue;
        if (sent < 0) return errno == EAGAIN || gone();
        lane.begin += static_cast<std::size_t>(sent);
      }
      if (!more) return true;
      const auto got = recv(from, lane.bytes.data(), lane.bytes.size(), 0);
      if (got < 0) return errno == EAGAIN || errno == EINTR || gone();
      if (got == 0) return gone();
      lane.begin = 0;
      lane.end = static_cast<std::size_t>(got);
      if (up) connection.to_read.spend(static_cast<double>(lane.end));
      if (up && !within_bounds(connection)) return false;
    }
    return true;
  }

  // Takes in what has just come up from a peer: ZMTP, a routing id of its own, memory. False when
  // `connection` was closed.
  bool within_bounds(Connection& connection) {
    std::string wrong = connection.stream.take({connection.up.bytes.data(), connection.up.end});
    const std::string& id = connection.stream.routing_id();
    if (wrong.empty() && !id.empty() &&
        routing_ids.emplace(id, &connection).first->second != &connection) {
      wrong = "another's routing id";
    }
    if (!wrong.empty()) {
      end(connection, &counts.closed_for_breach, "a peer sent " + wrong);
      return false;
    }
    held += connection.settle(Clock::now());
    while (held > options.held_bytes) {
      Connection* longest = nullptr;
      for (const auto& [name, other] : connections) {
        held += other->settle(Clock::now());
        if (other->held == 0) continue;
        if (longest == nullptr || other->moved < longest->moved) longest = other.get();
      }
      if (longest == nullptr || held <= options.held_bytes) return true;
      const bool self = longest == &connection;
      end(*longest, &counts.closed_for_memory, "peers hold too much of the daemon's memory");
      if (self) return false;
    }
    return true;
  }

  void listen_again(bool wanted) {
    if (listening == wanted) return;
    listening = wanted;
    watch(listener.fd(), wanted ? static_cast<std::uint32_t>(EPOLLIN) : 0u, EPOLL_CTL_MOD);
  }

  void tick() {
    listen_again(true);
    std::vector<std::string> names;
    for (const auto& [name, connection] : connections) names.push_back(name);
    const auto now = Clock::now();
    for (const std::string& name : names) {
      const auto found = connections.find(name);
      if (found == connections.end()) continue;
      Connection& connection = *found->second;
      held += connection.settle(Clock::now());
      if (connection.account->to_close) {
        end(connection, nullptr, {});
      } else if (connection.held > 0 && now - connection.moved > options.patience) {
        end(connection, &counts.closed_for_silence, "nothing of a peer could be delivered");
      } else if (connection.account->throttled) {
        serve(connection, false);
      }
    }
  }

  void end(Connection& connection, std::uint64_t* counter, const std::string& why) {
    {
      const std::lock_guard lock(mutex);
      accounts.erase(connection.name);
      if (counter != nullptr && std::has_single_bit(++*counter)) {
        spdlog::warn("connection closed times={} reason=\"{}\"", *counter, why);
      }
    }
    held -= connection.held;
    by_fd.erase(connection.peer);
    by_fd.erase(connection.inner);
    const auto claimed = routing_ids.find(connection.stream.routing_id());
    if (claimed != routing_ids.end() && claimed->second == &connection) routing_ids.erase(claimed);
    connections.erase(connections.find(connection.name));
    listen_again(true);
  }

  std::shared_ptr<Account> account_of(int inner_fd) {
    const std::string name = socket_name(inner_fd, &getpeername);
    const std::lock_guard lock(mutex);
    const auto found = accounts.find(name);
    return found == accounts.end() ? nullptr : found->second;
  }

  Listener listener;
  const std::string inner;
  GuardOptions options;
  int epoll = -1, wake = -1;
  std::atomic<bool> stopping{false};
  bool listening = true;
  std::map<int, Connection*> by_fd;                                // both descriptors
  std::map<std::string, std::unique_ptr<Connection>> connections;  // by name
  std::map<std::string, Connection*> routing_ids;
  std::atomic<std::uint64_t> held{0};

  mutable std::mutex mutex;  // of what follows
  std::map<std::string, std::shared_ptr<Account>> accounts;
  GuardCounts counts;

  std::thread thread;
};

Guard::Guard(Listener listener, std::string inner, const GuardOptions& options)
    : impl_(std::make_unique<Impl>(std::move(listener), std::move(inner), options)) {
  impl_->thread = std::thread([this] { impl_->work(); });
}

Guard::~Guard() {
  impl_->stopping = true;
  impl_->nudge();
  impl_->thread.join();
}

const std::string& Guard::endpoint() const { return impl_->listener.endpoint(); }

void Guard::delivered(int inner_fd, std::size_t bytes, std::size_t parts) {
  const auto account = impl_->account_of(inner_fd);
  if (!account) return;
  account->delivered += bytes + parts * (ZmtpStream::kPartCost + kWrapping);
  account->parts += parts;
  ++account->messages;
  if (account->throttled) impl_->nudge();
}

void Guard::served(int inner_fd) {
  if (const auto account = impl_->account_of(inner_fd)) account->served = true;
}

void Guard::close(int inner_fd) {
  const auto account = impl_->account_of(inner_fd);
  if (!account) return;
  account->to_close = true;
  impl_->nudge();
}

GuardCounts Guard::counts() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->counts;
}

std::uint64_t Guard::held_bytes() const { return impl_->held; }

}  // namespace brainshift::server
