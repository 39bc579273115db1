// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A queue from one thread to one other, of preallocated slots: the writer fills a slot in place,
// the reader reads it in place, and neither ever waits for the other.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace tessera {

/// Slot: default constructible; slots are reused as they were left. One thread calls claim() and
/// publish(), one thread calls front() and pop(); size() and peak() are for any. All are O(1) and
/// without locks, system calls or heap.
template <class Slot>
class SpscQueue {
 public:
  /// At least slots of them, rounded up to a power of two, from 1 to 2^20. The only use of the
  /// heap.
  explicit SpscQueue(std::size_t slots)
      : capacity_(std::bit_ceil(std::clamp<std::size_t>(slots, 1, kMaxSlots))),
        slots_(std::make_unique<Slot[]>(capacity_)) {}

  /// The writer's next slot, which it owns until publish(); nullptr iff the queue is full. Claiming
  /// again without publishing returns the same slot.
  [[nodiscard]] Slot* claim() noexcept {
    const std::uint64_t write = write_.load(std::memory_order_relaxed);
    if (write - seen_read_ == capacity_) {
      seen_read_ = read_.load(std::memory_order_acquire);
      if (write - seen_read_ == capacity_) return nullptr;
    }
    return &slots_[write & (capacity_ - 1)];
  }
  /// Passes the claimed slot on. A caller bug unless claim() returned one since the last call.
  void publish() noexcept {
    const std::uint64_t write = write_.load(std::memory_order_relaxed) + 1;
    write_.store(write, std::memory_order_release);
    const std::uint64_t waiting = write - read_.load(std::memory_order_relaxed);
    if (waiting > peak_.load(std::memory_order_relaxed))
      peak_.store(waiting, std::memory_order_relaxed);
  }

  /// The oldest slot, which the reader owns until pop(); nullptr iff the queue is empty.
  [[nodiscard]] Slot* front() noexcept {
    const std::uint64_t read = read_.load(std::memory_order_relaxed);
    if (read == seen_write_) {
      seen_write_ = write_.load(std::memory_order_acquire);
      if (read == seen_write_) return nullptr;
    }
    return &slots_[read & (capacity_ - 1)];
  }
  /// Returns the slot. A caller bug unless front() returned one since the last call.
  void pop() noexcept {
    read_.store(read_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  /// Slots that wait to be read: exact for a thread while the other does nothing.
  [[nodiscard]] std::size_t size() const noexcept {
    const std::uint64_t read = read_.load(std::memory_order_acquire);
    return static_cast<std::size_t>(write_.load(std::memory_order_acquire) - read);
  }
  /// Most slots that ever waited; never decreases.
  [[nodiscard]] std::size_t peak() const noexcept {
    return static_cast<std::size_t>(peak_.load(std::memory_order_relaxed));
  }

 private:
  static constexpr std::size_t kMaxSlots = std::size_t{1} << 20U;
  // Two threads that write within one cache line slow each other down.
  static constexpr std::size_t kLineBytes = 64;

  const std::size_t capacity_;
  const std::unique_ptr<Slot[]> slots_;
  // Positions only grow; 64 bits last for centuries.
  alignas(kLineBytes) std::atomic<std::uint64_t> write_{0};
  std::uint64_t seen_read_ = 0;  ///< The writer's last value of read_.
  std::atomic<std::uint64_t> peak_{0};
  alignas(kLineBytes) std::atomic<std::uint64_t> read_{0};
  std::uint64_t seen_write_ = 0;  ///< The reader's last value of write_.
};

}  // namespace tessera
