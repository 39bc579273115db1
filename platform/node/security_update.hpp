// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Passes what a node reloads of its configuration from the thread that reads files to the one that
// shares.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "link/fleet_keys.hpp"

namespace tessera {

struct SecurityUpdate {
  std::vector<std::uint32_t> exclude;  ///< The new list of excluded robots.
  FleetKeys keys;                      ///< Only the public keys are used.
};

/// From one thread, which reads files, to another, which never uses the heap.
class SecurityUpdates {
 public:
  /// For the reading thread. Frees the previous update. A caller bug while is_waiting().
  void offer(std::unique_ptr<SecurityUpdate> update) {
    held_ = std::move(update);
    waiting_.store(held_.get(), std::memory_order_release);
  }
  /// True if the last update is not done yet.
  [[nodiscard]] bool is_waiting() const noexcept {
    return waiting_.load(std::memory_order_acquire) != nullptr;
  }

  /// For the sharing thread: the waiting update, which it owns until done(); nullptr: none.
  [[nodiscard]] SecurityUpdate* waiting() noexcept {
    return waiting_.load(std::memory_order_acquire);
  }
  void done() noexcept { waiting_.store(nullptr, std::memory_order_release); }

 private:
  std::unique_ptr<SecurityUpdate> held_;
  std::atomic<SecurityUpdate*> waiting_{nullptr};
};

/// Returns a number that is equal for equal sets of robots, whatever their order and repetitions,
/// and 0 for none: CRC-32C of the robots, ascending, four bytes each, little-endian. No heap.
/// robots: at most ExchangeConfig::kMostExcluded.
[[nodiscard]] std::uint32_t exclude_digest(std::span<const std::uint32_t> robots) noexcept;

}  // namespace tessera
