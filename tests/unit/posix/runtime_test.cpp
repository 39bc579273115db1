// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Threads with roles, memory that is there, sleeping and waking, signs of life.
#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "base/heartbeat.hpp"
#include "base/memory_lock.hpp"
#include "base/monotonic_clock.hpp"
#include "base/service_notice.hpp"
#include "base/thread.hpp"
#include "base/wake_up.hpp"

namespace tessera {
namespace {

/// Runs a function in a thread of this role and waits for its end.
template <class Run>
ThreadRights run_as(const ThreadRole& role, Run&& run) {
  Thread thread;
  const auto call = [](void* context) { (*static_cast<Run*>(context))(); };
  REQUIRE(thread.start(role, call, &run).ok());
  thread.join();
  return thread.rights();
}

TEST_CASE("Thread: has the name of its role, and all signals are blocked in it") {
  std::array<char, 16> name{};
  bool blocked = false;
  auto run = [&] {
    ::pthread_getname_np(::pthread_self(), name.data(), name.size());
    sigset_t mask{};
    ::pthread_sigmask(SIG_SETMASK, nullptr, &mask);
    blocked = ::sigismember(&mask, SIGTERM) == 1 && ::sigismember(&mask, SIGINT) == 1;
  };
  // The name is given from outside, perhaps after the thread has begun: so it is asked there.
  std::atomic<bool> named{false};
  auto wait = [&] {
    while (!named) {
    }
    run();
  };
  Thread thread;
  const auto call = [](void* context) { (*static_cast<decltype(wait)*>(context))(); };
  REQUIRE(thread.start({.name = "a name that is too long"}, call, &wait).ok());
  named = true;
  thread.join();
  CHECK(std::string(name.data()) == "a name that is ");
  CHECK(blocked);
  sigset_t mine{};
  ::pthread_sigmask(SIG_SETMASK, nullptr, &mine);
  CHECK(::sigismember(&mine, SIGTERM) == 0);
}

TEST_CASE("Thread: says whether it got the priority and the processors that it asked for") {
  std::atomic<bool> go{false};
  int policy = -1;
  sched_param parameters{};
  auto run = [&] {
    while (!go) {
    }
    ::pthread_getschedparam(::pthread_self(), &policy, &parameters);
  };
  Thread thread;
  const auto call = [](void* context) { (*static_cast<decltype(run)*>(context))(); };
  REQUIRE(thread.start({.name = "role", .priority = 7, .cpus = 1}, call, &run).ok());
  go = true;
  thread.join();
  CHECK((policy == SCHED_FIFO && parameters.sched_priority == 7) == thread.rights().priority);
  CHECK(thread.rights().cpus);
}

TEST_CASE("Thread: a processor that there is none of is said, and the thread runs") {
  bool ran = false;
  const ThreadRights rights =
      run_as({.name = "role", .cpus = std::uint64_t{1} << 63U}, [&] { ran = true; });
  CHECK(ran);
  CHECK_FALSE(rights.cpus);
}

TEST_CASE("WakeUp: ends a sleep before its time, also one that has not begun") {
  WakeUp wake;
  const std::int64_t late_us = MonotonicClock::now_us() + 60'000'000;
  wake.wake();
  CHECK(wake.sleep_until(late_us));
  CHECK_FALSE(wake.sleep_until(MonotonicClock::now_us() - 1));
  CHECK_FALSE(wake.sleep_until(MonotonicClock::now_us() + 1000));
}

TEST_CASE("WakeUp: no wake is lost between two threads that take turns") {
  constexpr int kTurns = 20'000;
  WakeUp here;
  WakeUp there;
  int turns = 0;
  auto run = [&] {
    for (int i = 0; i < kTurns; ++i) {
      while (!there.sleep_until(MonotonicClock::now_us() + 60'000'000)) {
      }
      ++turns;
      here.wake();
    }
  };
  Thread thread;
  const auto call = [](void* context) { (*static_cast<decltype(run)*>(context))(); };
  REQUIRE(thread.start({.name = "other"}, call, &run).ok());
  for (int i = 0; i < kTurns; ++i) {
    there.wake();
    while (!here.sleep_until(MonotonicClock::now_us() + 60'000'000)) {
    }
    REQUIRE(turns == i + 1);
  }
}

TEST_CASE("memory: what was prefaulted costs no page fault") {
  constexpr std::size_t kBytes = std::size_t{8} << 20U;
  void* const at =
      ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  REQUIRE(at != MAP_FAILED);
  const std::span<std::byte> memory(static_cast<std::byte*>(at), kBytes);
  // What a sanitizer has beside it is there then.
  for (std::byte& byte : memory) byte = std::byte{1};
  REQUIRE(::madvise(at, kBytes, MADV_DONTNEED) == 0);
  const std::size_t resident_before = resident_bytes();
  const PageFaults before = thread_page_faults();
  prefault(memory);
  const PageFaults filled = thread_page_faults();
  for (std::byte& byte : memory) byte = std::byte{1};
  const PageFaults after = thread_page_faults();
  CHECK(filled.minor > before.minor);
  CHECK(after.minor == filled.minor);
  CHECK(after.major == filled.major);
  CHECK(resident_bytes() >= resident_before + kBytes / 2);
  ::munmap(at, kBytes);
}

TEST_CASE("memory: content that is there stays when it is prefaulted") {
  std::vector<std::byte> bytes(100'000, std::byte{7});
  prefault(bytes);
  CHECK(bytes == std::vector<std::byte>(100'000, std::byte{7}));
  prefault({});
}

TEST_CASE("memory: it is locked, or it is said why not") {
  const std::string why_not = lock_memory();
  if (!why_not.empty()) CHECK(why_not.find("LimitMEMLOCK") != std::string::npos);
  ::munlockall();
}

TEST_CASE("Heartbeat: late after its silence, never before the first beat or at rest") {
  Heartbeat heart("mapping", 1000);
  CHECK_FALSE(heart.is_late(1'000'000));
  heart.beat(5000);
  CHECK_FALSE(heart.is_late(6000));
  CHECK(heart.is_late(6001));
  heart.rest();
  CHECK_FALSE(heart.is_late(9'000'000));
}

TEST_CASE("ServiceNotice: tells the socket that the environment names") {
  const std::string path = "tessera_notice_test." + std::to_string(::getpid());
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  // An abstract name: gone with the socket.
  std::memcpy(address.sun_path + 1, path.data(), path.size());
  const FileDescriptor manager(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const auto bytes = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + path.size());
  REQUIRE(::bind(manager.get(), reinterpret_cast<const sockaddr*>(&address), bytes) == 0);
  ::setenv("NOTIFY_SOCKET", ("@" + path).c_str(), 1);
  ::setenv("WATCHDOG_USEC", "2000000", 1);
  ServiceNotice notice;
  CHECK(notice.is_heard());
  CHECK(notice.watchdog_us() == 2'000'000);
  notice.tell("READY=1");
  std::array<char, 64> text{};
  REQUIRE(::recv(manager.get(), text.data(), text.size(), 0) == 7);
  CHECK(std::string(text.data()) == "READY=1");
  // Of another process: not for this one.
  ::setenv("WATCHDOG_PID", "1", 1);
  CHECK_FALSE(ServiceNotice().watchdog_us());
  for (const char* const bad : {"soon", "0", "-5", "1x"}) {
    ::unsetenv("WATCHDOG_PID");
    ::setenv("WATCHDOG_USEC", bad, 1);
    CHECK_FALSE(ServiceNotice().watchdog_us());
  }
  for (const char* const name : {"NOTIFY_SOCKET", "WATCHDOG_USEC"}) ::unsetenv(name);
  ServiceNotice nobody;
  CHECK_FALSE(nobody.is_heard());
  nobody.tell("READY=1");
}

}  // namespace
}  // namespace tessera
