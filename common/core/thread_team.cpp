// SPDX-License-Identifier: Apache-2.0
#include "common/core/thread_team.hpp"

namespace brainshift {

ThreadTeam::ThreadTeam(int members) {
  if (members <= 0) members = static_cast<int>(std::thread::hardware_concurrency());
  for (int member = 1; member < members; ++member) {
    threads_.emplace_back([this, member] { work(member); });
  }
}

ThreadTeam::~ThreadTeam() {
  stopped_ = true;
  ++round_;
  round_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void ThreadTeam::run(Function function, void* context) {
  function_ = function;
  context_ = context;
  busy_ = static_cast<int>(threads_.size());
  ++round_;
  round_.notify_all();
  function(context, 0);
  for (int left = busy_; left > 0; left = busy_) busy_.wait(left);
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
