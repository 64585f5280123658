// SPDX-License-Identifier: Apache-2.0
// ThreadTeam: a fixed number of threads that work on the same task, each on its own fixed part.
//
// Part i of a task always runs on the same member and always covers the same items, so results do
// not depend on timing. The caller is member 0; the others sleep between tasks. A team has at most
// 16 members (TasksMax in docker/brainshiftd.service). run() itself does not allocate.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

namespace brainshift {

class ThreadTeam {
 public:
  // Threads, the caller included; 0: as many as cores. Throws std::system_error: no more threads.
  explicit ThreadTeam(int members = 0);
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  int size() const { return static_cast<int>(threads_.size()) + 1; }

  // Calls task(member) once for every member in [0, size()); ends when all are done, and throws the
  // first exception that one of them threw. Only one thread at a time may call it.
  template <typename Task>
  void run(Task& task) {
    run([](void* context, int member) { (*static_cast<Task*>(context))(member); }, &task);
  }
  // Calls body(begin, end) with equal, contiguous parts of [0, count), one per member.
  template <typename Body>
  void split(long count, Body&& body) {
    auto task = [&](int member) {
      const long begin = count * member / size();
      const long end = count * (member + 1) / size();
      if (begin < end) body(begin, end);
    };
    run(task);
  }

 private:
  using Function = void (*)(void*, int);
  void run(Function function, void* context);
  void work(int member);

  Function function_ = nullptr;
  void* context_ = nullptr;
  std::atomic<unsigned> round_{0};
  std::atomic<int> busy_{0};
  std::atomic<bool> stopped_{false};
  std::vector<std::thread> threads_;
};

}  // namespace brainshift
