// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A log without waiting: a thread adds a record to its own queue, with a constant text and up to
// three numbers, and another thread writes the lines. Records that do not fit are counted.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/spsc_queue.hpp"

namespace tessera {

/// Numbers of syslog.
enum class LogLevel : std::uint8_t { kError = 3, kWarning = 4, kInfo = 6 };

struct LogRecord {
  std::int64_t stamp_us = 0;   ///< MonotonicClock.
  const char* text = nullptr;  ///< Static text; each % in it stands for the next number.
  std::array<std::int64_t, 3> numbers{};
  LogLevel level = LogLevel::kInfo;
  bool is_change = false;  ///< A change of state: always written.
};

/// One thread adds records, another takes them.
class LogQueue {
 public:
  /// name: of the thread, static text.
  explicit LogQueue(const char* name, std::size_t records = 256) : name_(name), queue_(records) {}

  /// Never waits, no system call, no heap. False, and counted, iff there is no room.
  bool say(LogLevel level, std::int64_t stamp_us, const char* text, std::int64_t a = 0,
           std::int64_t b = 0, std::int64_t c = 0) noexcept {
    return put({stamp_us, text, {a, b, c}, level, false});
  }
  /// The same for a change of state, so that the last line has the current state.
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
  /// Most records per call, so that a flood does not block its thread.
  static constexpr int kMostRecords = 256;
  /// Period in which a text is written once, unless it is a change of state; the next line has the
  /// number of repetitions.
  static constexpr std::int64_t kQuiet_us = 1'000'000;

  /// descriptor: output of lines; stays the caller's. prefixed: each line begins with its level, in
  /// the format of the journal.
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
