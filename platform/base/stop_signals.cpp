// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/stop_signals.hpp"

#include <signal.h>

namespace tessera {

namespace {

std::atomic<std::atomic<bool>*> wish{nullptr};
static_assert(std::atomic<bool>::is_always_lock_free &&
              std::atomic<std::atomic<bool>*>::is_always_lock_free);

}  // namespace

void stop_by_signals(std::atomic<bool>& stop) {
  wish.store(&stop, std::memory_order_relaxed);
  struct sigaction action {};
  action.sa_handler = [](int) {
    wish.load(std::memory_order_relaxed)->store(true, std::memory_order_relaxed);
    for (const int signal : {SIGTERM, SIGINT}) ::signal(signal, SIG_DFL);
  };
  ::sigemptyset(&action.sa_mask);
  for (const int signal : {SIGTERM, SIGINT}) ::sigaction(signal, &action, nullptr);
}

}  // namespace tessera
