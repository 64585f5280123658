// SPDX-License-Identifier: GPL-3.0-or-later
// Preloaded into the daemon (LD_PRELOAD): a machine with other numbers of hardware threads, a bound
// on threads, an allocation that fails. Changes nothing unless told to:
//   FAULT_SHIM_CPUS=N        the system reports N hardware threads
//   FAULT_SHIM_TASKS=N       pthread_create fails with EAGAIN while N threads live (TasksMax)
//   FAULT_SHIM_CONTROL=FILE  a ShimControl (shim_control.hpp), mapped: which allocation fails
// Allocations by libzmq, and on its threads, are neither counted nor failed: it ends the process by
// itself then (docs/hazards.md).
#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>

#include "tests/faults/shim_control.hpp"

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
}

namespace {

using brainshift::faults::ShimControl;

ShimControl* control = nullptr;
std::uintptr_t zmq_begin = 0, zmq_end = 0;
std::atomic<int> threads{1};

int number_of(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? 0 : std::atoi(text);
}

int find_zmq(dl_phdr_info* info, std::size_t, void*) {
  if (std::strstr(info->dlpi_name, "libzmq") == nullptr) return 0;
  zmq_begin = info->dlpi_addr;
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const auto& part = info->dlpi_phdr[i];
    if (part.p_type != PT_LOAD) continue;
    zmq_end = std::max(zmq_end, info->dlpi_addr + part.p_vaddr + part.p_memsz);
  }
  return 1;
}

__attribute__((constructor)) void begin() {
  const char* file = std::getenv("FAULT_SHIM_CONTROL");
  if (file == nullptr) return;
  dl_iterate_phdr(find_zmq, nullptr);
  const int fd = open(file, O_RDWR | O_CLOEXEC);
  void* map = mmap(nullptr, sizeof(ShimControl), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  close(fd);
  if (map == MAP_FAILED) std::abort();
  control = static_cast<ShimControl*>(map);
}

bool on_zmq_thread() {
  static thread_local int of_zmq = -1;
  if (of_zmq < 0) {
    char name[16] = {};
    prctl(PR_GET_NAME, name);
    of_zmq = std::strncmp(name, "ZMQbg", 5) == 0 ? 1 : 0;
  }
  return of_zmq == 1;
}

bool fails(void* caller) {
  if (control == nullptr || control->left.load(std::memory_order_relaxed) <= 0) return false;
  const auto at = reinterpret_cast<std::uintptr_t>(caller);
  if ((at >= zmq_begin && at < zmq_end) || on_zmq_thread()) return false;
  ++control->counted;
  if (control->left.fetch_sub(1) != 1) return false;
  ++control->failed;
  return true;
}

void* or_bad_alloc(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

#define CALLER __builtin_return_address(0)

extern "C" {

void* malloc(std::size_t size) {
  if (fails(CALLER)) return errno = ENOMEM, nullptr;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  if (fails(CALLER)) return errno = ENOMEM, nullptr;
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  if (fails(CALLER)) return errno = ENOMEM, nullptr;
  return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  if (fails(CALLER)) return errno = ENOMEM, nullptr;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  if (fails(CALLER)) return ENOMEM;
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}

int get_nprocs() {
  const int simulated = number_of("FAULT_SHIM_CPUS");
  if (simulated > 0) return simulated;
  static auto* real = reinterpret_cast<int (*)()>(dlsym(RTLD_NEXT, "get_nprocs"));
  return real();
}
long sysconf(int name) {
  const int simulated = number_of("FAULT_SHIM_CPUS");
  if (simulated > 0 && (name == _SC_NPROCESSORS_ONLN || name == _SC_NPROCESSORS_CONF)) {
    return simulated;
  }
  static auto* real = reinterpret_cast<long (*)(int)>(dlsym(RTLD_NEXT, "sysconf"));
  return real(name);
}

struct Start {
  void* (*function)(void*);
  void* argument;
};

static void* run_thread(void* pointer) {
  const Start start = *static_cast<Start*>(pointer);
  std::free(pointer);
  struct Leaves {
    ~Leaves() { --threads; }
  } leaves;
  return start.function(start.argument);
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*function)(void*),
                   void* argument) {
  static auto* real =
      reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  const int most = number_of("FAULT_SHIM_TASKS");
  if (++threads > most && most > 0) return --threads, EAGAIN;
  auto* start = static_cast<Start*>(__libc_malloc(sizeof(Start)));
  *start = {function, argument};
  const int error = real(thread, attributes, run_thread, start);
  if (error != 0) {
    --threads;
    std::free(start);
  }
  return error;
}

}  // extern "C"

void* operator new(std::size_t size) {
  if (fails(CALLER)) throw std::bad_alloc();
  return or_bad_alloc(__libc_malloc(size));
}
void* operator new[](std::size_t size) {
  if (fails(CALLER)) throw std::bad_alloc();
  return or_bad_alloc(__libc_malloc(size));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return fails(CALLER) ? nullptr : __libc_malloc(size);
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return fails(CALLER) ? nullptr : __libc_malloc(size);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  if (fails(CALLER)) throw std::bad_alloc();
  return or_bad_alloc(__libc_memalign(static_cast<std::size_t>(alignment), size));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
