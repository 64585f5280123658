// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/tools/bridge/bridge.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <thread>
#include <utility>

#include "client/tools/bridge/follower.hpp"
#include "client/tools/bridge/hub.hpp"
#include "client/tools/bridge/inbound_worker.hpp"
#include "client/tools/bridge/picture.hpp"

namespace brainshift::client {

struct Bridge::Impl {
  BridgeOptions options;
  Tell tell;
  int stop_descriptor = -1;
  std::unique_ptr<InboundWorker> worker;
  std::unique_ptr<Hub> hub;
  std::unique_ptr<Follower> follower;

  ~Impl() {
    if (stop_descriptor >= 0) ::close(stop_descriptor);
  }
  void note(const std::string& sentence) const { tell(note_line(sentence, options.json)); }
  FollowerCalls follower_calls();
};

Status validate(const BridgeOptions& options) {
  const bool brings = options.inbox.wants_images() || options.inbox.wants_models();
  if (options.inbox.wants_images() && !options.from) {
    return invalid("--contours and --seeds are for the images of a server: name it with --from");
  }
  if (options.from && !brings) {
    return invalid("--from " + to_string(*options.from) +
                   ": say what of it to use, with --contours, --seeds, --tumour-device, "
                   "--surface-device or --landmarks-after");
  }
  if (options.from && options.from->port == 0) {
    return invalid("--from " + to_string(*options.from) + ": the port must be 1 to 65535");
  }
  return {};
}

FollowerCalls Bridge::Impl::follower_calls() {
  FollowerCalls calls;
  calls.show = [this](PicturePtr picture) {
    hub->post(std::move(picture), Broadcast::Part::kWhole);
  };
  calls.show_state = [this](PicturePtr picture) {
    hub->post(std::move(picture), Broadcast::Part::kState);
  };
  calls.followed = [this](const Followed& followed) { worker->follow(followed); };
  calls.tell = [this](const std::string& sentence) { note(sentence); };
  calls.shown = [this](const Picture& picture, const FieldStream& stream, double made_ms) {
    tell(shown_line({picture.state, stream.grid().dims, made_ms, hub->peers(), hub->replaced()},
                    options.json));
  };
  return calls;
}

Bridge::Bridge(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Bridge::~Bridge() = default;

Result<std::unique_ptr<Bridge>> Bridge::open(const BridgeOptions& options, Tell tell) {
  if (auto ok = validate(options); !ok) return tl::unexpected(ok.error());
  auto inbox = Inbox::open(options.inbox);
  if (!inbox) return tl::unexpected(inbox.error());
  auto impl = std::make_unique<Impl>();
  Impl& self = *impl;
  self.options = options;
  self.tell = std::move(tell);
  self.stop_descriptor = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (self.stop_descriptor < 0) {
    return fail(ErrorCode::kInternal, std::string("no event descriptor: ") + std::strerror(errno));
  }
  HubOptions hub;
  hub.listen = options.listen;
  hub.from = options.from;
  hub.from_peers = inbox->from_peers();
  hub.from_upstream = inbox->from_upstream();
  const auto note = [&self](const std::string& sentence) { self.note(sentence); };
  self.worker = std::make_unique<InboundWorker>(std::move(*inbox), options.endpoint, options.keys,
                                                note, options.case_id);
  auto opened = Hub::open(
      hub, note, [&self](igtl::Message&& message) { self.worker->post(std::move(message)); });
  if (!opened) return tl::unexpected(opened.error());
  self.hub = std::move(*opened);
  self.follower = std::make_unique<Follower>(
      FollowerOptions{options.endpoint, options.keys, options.stream}, self.follower_calls());
  return std::unique_ptr<Bridge>(new Bridge(std::move(impl)));
}

Address Bridge::address() const { return impl_->hub->address(); }

Status Bridge::run() {
  Impl& self = *impl_;
  Status followed;
  Status served;
  {
    std::jthread worker([&](const std::stop_token& stop) { self.worker->run(stop); });
    std::jthread follower([&](const std::stop_token& stop) {
      followed = self.follower->run(stop);
      if (!followed) this->stop();
    });
    served = self.hub->run(self.stop_descriptor);
  }
  return served ? followed : served;
}

int Bridge::stop_fd() const { return impl_->stop_descriptor; }

void Bridge::stop() {
  const std::uint64_t one = 1;
  static_cast<void>(!::write(impl_->stop_descriptor, &one, sizeof one));
}

}  // namespace brainshift::client
