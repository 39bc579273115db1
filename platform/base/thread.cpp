// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/thread.hpp"

#include <sched.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <utility>

#include "base/memory_lock.hpp"

namespace tessera {

namespace {

struct Start {
  void (*run)(void*);
  void* context;
};

void* run_prefaulted(void* context) {
  const std::unique_ptr<Start> start(static_cast<Start*>(context));
  const Start given = *start;
  prefault_stack();
  given.run(given.context);
  return nullptr;
}

/// Attributes that are always destroyed.
class Attributes {
 public:
  Attributes() { ok_ = ::pthread_attr_init(&attributes_) == 0; }
  Attributes(const Attributes&) = delete;
  Attributes& operator=(const Attributes&) = delete;
  ~Attributes() {
    if (ok_) ::pthread_attr_destroy(&attributes_);
  }
  pthread_attr_t* get() { return &attributes_; }

 private:
  pthread_attr_t attributes_{};
  bool ok_ = false;
};

bool set_priority(pthread_t thread, int priority) {
  if (priority == 0) return true;
  sched_param parameters{};
  parameters.sched_priority = priority;
  return ::pthread_setschedparam(thread, SCHED_FIFO, &parameters) == 0;
}

bool set_cpus(pthread_t thread, std::uint64_t cpus) noexcept {
  if (cpus == 0) return true;
  cpu_set_t set;
  CPU_ZERO(&set);
  for (unsigned cpu = 0; cpu < 64; ++cpu) {
    if ((cpus >> cpu & 1U) != 0) CPU_SET(cpu, &set);
  }
  return ::pthread_setaffinity_np(thread, sizeof set, &set) == 0;
}

}  // namespace

bool keep_to_cpus(std::uint64_t cpus) noexcept { return set_cpus(::pthread_self(), cpus); }

std::int64_t thread_number() noexcept { return ::gettid(); }

Outcome<void> Thread::start(const ThreadRole& role, void (*run)(void*), void* context) {
  auto start = std::make_unique<Start>(Start{run, context});
  Attributes attributes;
  ::pthread_attr_setstacksize(attributes.get(), kStackBytes);
  // The new thread inherits that all signals are blocked.
  sigset_t all{};
  sigset_t before{};
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, &before);
  const int error = ::pthread_create(&thread_, attributes.get(), run_prefaulted, start.get());
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (error != 0) {
    return Failure{"cannot start the thread " + role.name + ": " + std::strerror(error) +
                       "; close other programs, then try again",
                   FailureKind::kFailure};
  }
  static_cast<void>(start.release());
  is_running_ = true;
  constexpr std::size_t kMostName = 15;
  ::pthread_setname_np(thread_, role.name.substr(0, kMostName).c_str());
  rights_ = {.priority = set_priority(thread_, role.priority),
             .cpus = set_cpus(thread_, role.cpus)};
  return {};
}

void Thread::join() noexcept {
  if (std::exchange(is_running_, false)) ::pthread_join(thread_, nullptr);
}

}  // namespace tessera
