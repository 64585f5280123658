// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/transport/zap_handler.hpp"

#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <new>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "server/transport/uninterrupted.hpp"

namespace brainshift::server {
namespace {

constexpr const char* kAddress = "inproc://zeromq.zap.01";
constexpr const char* kVersion = "1.0";
constexpr std::size_t kKeyBytes = 32;

// The parts of a request, in their order.
enum Part { kVersionPart, kRequestId, kDomain, kPeer, kIdentity, kMechanism, kKey, kParts };

std::vector<zmq::message_t> receive_all(zmq::socket_t& socket) {
  std::vector<zmq::message_t> parts;
  do {
    zmq::message_t part;
    if (!uninterrupted([&] { return socket.recv(part, zmq::recv_flags::dontwait); })) break;
    parts.push_back(std::move(part));
  } while (parts.back().more());
  return parts;
}

// The key as text; nullopt when the request is none for CURVE.
std::optional<std::string> key_of(const std::vector<zmq::message_t>& parts) {
  if (parts.size() != kParts || parts[kVersionPart].to_string_view() != kVersion ||
      parts[kMechanism].to_string_view() != "CURVE" || parts[kKey].size() != kKeyBytes) {
    return std::nullopt;
  }
  char text[41];
  if (zmq_z85_encode(text, parts[kKey].data<std::uint8_t>(), kKeyBytes) == nullptr) {
    return std::nullopt;
  }
  return std::string(text);
}

}  // namespace

ZapHandler::ZapHandler(zmq::context_t& context, KeyNames names)
    : names_(std::move(names)), socket_(context, zmq::socket_type::rep) {
  socket_.set(zmq::sockopt::linger, 0);
  socket_.bind(kAddress);
  stop_fd_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (stop_fd_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  thread_ = std::thread([this] { work(); });
}

ZapHandler::~ZapHandler() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = write(stop_fd_, &one, sizeof one);
  thread_.join();
  close(stop_fd_);
  try {
    socket_.unbind(kAddress);  // at once: closing alone frees the address some time later
  } catch (const zmq::error_t&) {
    // The next handler of the context finds the address in use.
  }
}

void ZapHandler::work() {
  zmq::pollitem_t items[] = {{socket_.handle(), 0, ZMQ_POLLIN, 0},
                             {nullptr, stop_fd_, ZMQ_POLLIN, 0}};
  try {
    while (true) {
      if (zmq_poll(items, 2, -1) < 0) {
        if (zmq_errno() == EINTR) continue;
        break;
      }
      if (items[1].revents != 0) break;
      if (items[0].revents == 0) continue;
      try {
        answer();
      } catch (const std::bad_alloc&) {  // this one may ask again
        spdlog::error("a key could not be checked: no memory");
      }
    }
  } catch (const zmq::error_t& error) {
    // Nobody is admitted from here on; who is connected stays.
    spdlog::error("keys can no longer be checked: {}", error.what());
  }
}

void ZapHandler::answer() {
  const auto parts = receive_all(socket_);
  if (parts.size() <= kRequestId) return;  // libzmq asks properly
  const auto key = key_of(parts);
  const auto known = key ? names_.find(*key) : names_.end();
  const bool admit = known != names_.end();
  const std::string name = admit ? known->second : std::string();
  if (admit) {
    spdlog::debug("key admitted name={}", name);
  } else if (std::has_single_bit(++refused_)) {
    // A stranger that repeats itself fills no log. Public keys are no secret.
    spdlog::warn("unknown key refused times={} key={}", refused_.load(), key.value_or("none"));
  }
  constexpr auto kMore = zmq::send_flags::sndmore;
  const std::string code = admit ? "200" : "400", text = admit ? "OK" : "unknown key";
  for (const std::string& part :
       {std::string(kVersion), parts[kRequestId].to_string(), code, text, name}) {
    uninterrupted([&] { return socket_.send(zmq::buffer(part), kMore); });
  }
  const auto no_metadata = [&] { return socket_.send(zmq::message_t(), zmq::send_flags::none); };
  uninterrupted(no_metadata);
}

}  // namespace brainshift::server
