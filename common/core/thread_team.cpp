// SPDX-License-Identifier: Apache-2.0
#include "common/core/thread_team.hpp"

#include <algorithm>
#include <exception>

namespace brainshift {
namespace {

// A daemon keeps a team for each kind of session, and its service manager bounds its threads.
constexpr int kMaxMembers = 16;

void end(std::atomic<bool>& stopped, std::atomic<unsigned>& round,
         std::vector<std::thread>& threads) {
  stopped = true;
  ++round;
  round.notify_all();
  for (std::thread& thread : threads) thread.join();
}

}  // namespace

ThreadTeam::ThreadTeam(int members) {
  if (members <= 0) members = static_cast<int>(std::thread::hardware_concurrency());
  members = std::min(members, kMaxMembers);
  try {
    for (int member = 1; member < members; ++member) {
      threads_.emplace_back([this, member] { work(member); });
    }
  } catch (...) {
    end(stopped_, round_, threads_);
    throw;
  }
}

ThreadTeam::~ThreadTeam() { end(stopped_, round_, threads_); }

void ThreadTeam::run(Function function, void* context) {
  struct Guarded {
    Function function;
    void* context;
    std::atomic<bool> failed{false};
    std::exception_ptr failure;
  } guarded{function, context, {}, {}};
  function_ = [](void* pointer, int member) {
    auto& task = *static_cast<Guarded*>(pointer);
    try {
      task.function(task.context, member);
    } catch (...) {
      if (!task.failed.exchange(true)) task.failure = std::current_exception();
    }
  };
  context_ = &guarded;
  busy_ = static_cast<int>(threads_.size());
  ++round_;
  round_.notify_all();
  function_(context_, 0);
  for (int left = busy_; left > 0; left = busy_) busy_.wait(left);
  if (guarded.failure) std::rethrow_exception(guarded.failure);
}

void ThreadTeam::work(int member) {
  unsigned seen = 0;
  for (;;) {
    round_.wait(seen);
    seen = round_;
    if (stopped_) return;
    function_(context_, member);
    if (--busy_ == 0) busy_.notify_one();
  }
}

}  // namespace brainshift
