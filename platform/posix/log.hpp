// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A log that costs a thread no waiting: it puts a record into a queue of its own, with a text that
// never changes and up to three numbers, and another thread writes the lines. What the queue has
// no room for is counted.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "posix/spsc_queue.hpp"

namespace tessera {

/// As syslog numbers them.
enum class LogLevel : std::uint8_t { kError = 3, kWarning = 4, kInfo = 6 };

struct LogRecord {
  std::int64_t stamp_us = 0;   ///< MonotonicClock.
  const char* text = nullptr;  ///< Of the program; each % in it stands for the next number.
  std::array<std::int64_t, 3> numbers{};
  LogLevel level = LogLevel::kInfo;
  bool is_change = false;  ///< Of a state: written however soon it comes again.
};

/// One thread says, another takes.
class LogQueue {
 public:
  /// name: of the thread, of the program.
  explicit LogQueue(const char* name, std::size_t records = 256) : name_(name), queue_(records) {}

  /// Never waits, no system call, no heap. False, and counted, iff there is no room.
  bool say(LogLevel level, std::int64_t stamp_us, const char* text, std::int64_t a = 0,
           std::int64_t b = 0, std::int64_t c = 0) noexcept {
    return put({stamp_us, text, {a, b, c}, level, false});
  }
  /// The same of a change of state, so that the last line tells what holds.
  bool say_change(LogLevel level, std::int64_t stamp_us, const char* text, std::int64_t a = 0,
                  std::int64_t b = 0) noexcept {
    return put({stamp_us, text, {a, b, 0}, level, true});
  }
  [[nodiscard]] std::uint64_t lost() const noexcept {
    return lost_.load(std::memory_order_relaxed);
  }

 private:
  friend class LogWriter;
  bool put(const LogRecord& said) noexcept {
    LogRecord* const record = queue_.claim();
    if (record == nullptr) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    *record = said;
    queue_.publish();
    return true;
  }
  const char* name_;
  SpscQueue<LogRecord> queue_;
  std::atomic<std::uint64_t> lost_{0};
  std::uint64_t told_lost_ = 0;
};

/// Writes lines to a file descriptor. For one thread.
class LogWriter {
 public:
  /// Records of a call, so that a flood keeps its thread from nothing else.
  static constexpr int kMostRecords = 256;
  /// Within which a text is written once, unless it tells of a change of state; how often it was
  /// said is with the next one.
  static constexpr std::int64_t kQuiet_us = 1'000'000;

  /// descriptor: where lines go; stays the caller's. prefixed: each line begins with its level, as
  /// the journal reads it.
  LogWriter(int descriptor, bool prefixed) : descriptor_(descriptor), prefixed_(prefixed) {}

  /// Writes what waits: lines of at most 256 bytes; a line that cannot be written is lost. No heap.
  void write(std::span<LogQueue* const> queues) noexcept;
  [[nodiscard]] std::uint64_t lines() const noexcept { return lines_; }

 private:
  struct Said {
    const char* text = nullptr;
    std::int64_t last_us = 0;
    std::uint64_t held_back = 0;
  };
  void write(const char* name, const LogRecord& record) noexcept;
  [[nodiscard]] Said& said(const LogRecord& record) noexcept;
  void put_line(LogLevel level, const char* name, const char* text,
                std::span<const std::int64_t> numbers, std::uint64_t times) noexcept;

  int descriptor_;
  bool prefixed_;
  std::array<Said, 64> said_{};
  std::uint64_t lines_ = 0;
};

}  // namespace tessera
