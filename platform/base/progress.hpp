// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Shows the progress of long work: a bar that is redrawn in place on a terminal, at most ten times
// a second; otherwise (logs, pipes) a plain line for about each tenth of the work. After
// construction it never uses the heap, so that it may run inside a loop that must not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tessera {

class Progress {
 public:
  static constexpr int kStandardError = 2;
  static constexpr std::uint64_t kEndless = ~std::uint64_t{0};

  /// label: name of the work, cut to 31 bytes. total: units of work; kEndless: not known, so that
  /// no share and no remaining time is shown, and plain lines come only at the end. descriptor:
  /// stays the caller's.
  Progress(std::string_view label, std::uint64_t total, int descriptor = kStandardError) noexcept;
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// Ends the line of an unfinished bar, so that whatever is printed next starts on its own.
  ~Progress();

  /// done: units finished so far, more than total counts as total. suffix: a few words for the end
  /// of the line ("12.3 ms/scan"), cut to 47 bytes; empty keeps the last one.
  void update(std::uint64_t done, std::string_view suffix = {}) noexcept;
  /// Prints a separate line (for example a warning) without breaking the bar.
  void note(std::string_view line) noexcept;
  /// Shows the final state and ends the line. Further calls do nothing.
  void finish() noexcept;

 private:
  static constexpr std::size_t kLineBytes = 320;
  using Line = std::array<char, kLineBytes>;

  [[nodiscard]] unsigned percent() const noexcept;
  std::size_t format_state(Line& line, const char* separator) const noexcept;
  void draw_bar() noexcept;
  void print_plain() noexcept;
  void put(const char* bytes, std::size_t count) const noexcept;

  std::array<char, 32> label_{};
  std::array<char, 48> suffix_{};
  std::uint64_t total_;
  std::uint64_t done_ = 0;
  std::int64_t start_us_;
  std::int64_t next_draw_us_;
  unsigned next_plain_percent_ = 10;
  std::uint64_t plain_done_ = ~std::uint64_t{0};  ///< done_ of the last plain line.
  int descriptor_;
  bool is_terminal_;
  bool bar_on_screen_ = false;
  bool finished_ = false;
};

}  // namespace tessera
