// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Threads with a role: a visible name, a priority, and processors. What the system does not permit
// is left out and reported, so that a program without real-time rights still runs.
#pragma once

#include <pthread.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "base/outcome.hpp"

namespace tessera {

struct ThreadRole {
  std::string name;  ///< Cut to 15 bytes.
  /// Of SCHED_FIFO, 1 .. 99; 0: the default scheduling.
  int priority = 0;
  std::uint64_t cpus = 0;  ///< A bit each, the first 64; 0: any.
};

/// The role that a thread got.
struct ThreadRights {
  bool priority = true;  ///< False: requested, and not permitted.
  bool cpus = true;
};
/// Restricts the calling thread, and those that it starts from now on, to these processors, a bit
/// each; 0: unchanged. False iff the system does not permit it.
[[nodiscard]] bool keep_to_cpus(std::uint64_t cpus) noexcept;
/// The system's number of the calling thread.
[[nodiscard]] std::int64_t thread_number() noexcept;

/// A thread that is started once and joined. Its stack has a fixed size and is touched before it
/// runs, so that it causes no page faults later. All signals are blocked in it: they are for the
/// program's first thread.
class Thread {
 public:
  static constexpr std::size_t kStackBytes = 512U << 10U;

  Thread() = default;
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;
  ~Thread() { join(); }

  /// Runs run(context) in a thread of this role. Fails with kFailure iff the system gives no
  /// thread; a caller bug if it runs already.
  Outcome<void> start(const ThreadRole& role, void (*run)(void* context), void* context);
  /// Waits until it has ended; returns at once if it never ran.
  void join() noexcept;

  [[nodiscard]] bool is_running() const noexcept { return is_running_; }
  [[nodiscard]] const ThreadRights& rights() const noexcept { return rights_; }

 private:
  pthread_t thread_{};
  bool is_running_ = false;
  ThreadRights rights_;
};

}  // namespace tessera
