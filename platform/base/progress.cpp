// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <span>

#include "base/monotonic_clock.hpp"

namespace tessera {
namespace {

constexpr std::int64_t kRedrawInterval_us = 100'000;
constexpr std::size_t kDefaultColumns = 80;
constexpr std::size_t kMinBarColumns = 5;
constexpr std::size_t kMaxBarColumns = 40;
constexpr unsigned kPlainStepPercent = 10;
constexpr std::string_view kClearToEndOfLine = "\x1b[K";

template <std::size_t kBytes>
void copy_cut(std::string_view from, std::array<char, kBytes>& to) {
  to.fill('\0');
  std::copy_n(from.begin(), std::min(from.size(), kBytes - 1), to.begin());
}

/// The length that snprintf has written; it returns the length without a limit.
std::size_t written(int wanted, std::size_t capacity) {
  return wanted < 0 ? 0 : std::min(static_cast<std::size_t>(wanted), capacity - 1);
}

std::size_t columns_of(int descriptor) {
  winsize size{};
  if (::ioctl(descriptor, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kDefaultColumns;
  return size.ws_col;
}

bool understands_redrawing(int descriptor) {
  const char* terminal = std::getenv("TERM");
  return ::isatty(descriptor) == 1 &&
         !(terminal != nullptr && std::string_view(terminal) == "dumb");
}

using DurationText = std::array<char, 24>;

/// "0:07", "12:34", "1:02:03".
DurationText duration_text(std::uint64_t duration_us) {
  DurationText text{};
  const std::uint64_t total_s = duration_us / 1'000'000;
  const std::uint64_t hours = total_s / 3600;
  const std::uint64_t minutes = total_s / 60 % 60;
  const std::uint64_t seconds = total_s % 60;
  if (hours > 0) {
    std::snprintf(text.data(), text.size(), "%" PRIu64 ":%02u:%02u", hours,
                  static_cast<unsigned>(minutes), static_cast<unsigned>(seconds));
  } else {
    std::snprintf(text.data(), text.size(), "%u:%02u", static_cast<unsigned>(minutes),
                  static_cast<unsigned>(seconds));
  }
  return text;
}

}  // namespace

Progress::Progress(std::string_view label, std::uint64_t total, int descriptor) noexcept
    : total_(total),
      start_us_(MonotonicClock::now_us()),
      next_draw_us_(start_us_),
      descriptor_(descriptor),
      is_terminal_(understands_redrawing(descriptor)) {
  copy_cut(label, label_);
}

Progress::~Progress() {
  if (bar_on_screen_) put("\n", 1);
}

void Progress::update(std::uint64_t done, std::string_view suffix) noexcept {
  if (finished_) return;
  done_ = std::min(done, total_);
  if (!suffix.empty()) copy_cut(suffix, suffix_);
  if (is_terminal_) {
    if (MonotonicClock::now_us() >= next_draw_us_) draw_bar();
  } else if (percent() >= next_plain_percent_) {
    print_plain();
  }
}

void Progress::note(std::string_view line) noexcept {
  if (bar_on_screen_) {
    put("\r", 1);
    put(kClearToEndOfLine.data(), kClearToEndOfLine.size());
    bar_on_screen_ = false;
    next_draw_us_ = 0;  // The bar comes back with the next update.
  }
  put(line.data(), line.size());
  put("\n", 1);
}

void Progress::finish() noexcept {
  if (finished_) return;
  finished_ = true;
  if (is_terminal_) {
    draw_bar();
    put("\n", 1);
    bar_on_screen_ = false;
  } else if (done_ != plain_done_) {
    print_plain();
  }
}

unsigned Progress::percent() const noexcept {
  if (total_ == 0) return 100;
  return static_cast<unsigned>(100.0 * static_cast<double>(done_) / static_cast<double>(total_));
}

std::size_t Progress::format_state(Line& line, const char* separator) const noexcept {
  const auto elapsed_us = static_cast<std::uint64_t>(MonotonicClock::now_us() - start_us_);
  const DurationText elapsed = duration_text(elapsed_us);
  const bool has_suffix = suffix_[0] != '\0';
  if (total_ == kEndless) {
    const int wanted =
        std::snprintf(line.data(), line.size(), "%" PRIu64 " done%s%s elapsed%s%s", done_,
                      separator, elapsed.data(), has_suffix ? separator : "", suffix_.data());
    return written(wanted, line.size());
  }
  DurationText remaining{"?"};
  if (done_ > 0) {
    const double share_left = static_cast<double>(total_ - done_) / static_cast<double>(done_);
    const double left_us = std::min(static_cast<double>(elapsed_us) * share_left, 1e15);
    remaining = duration_text(static_cast<std::uint64_t>(left_us));
  }
  const bool is_complete = done_ == total_;
  const int wanted = std::snprintf(
      line.data(), line.size(), "%u %%%s%" PRIu64 "/%" PRIu64 "%s%s elapsed%s%s%s%s%s", percent(),
      separator, done_, total_, separator, elapsed.data(), is_complete ? "" : separator,
      is_complete ? "" : remaining.data(), is_complete ? "" : " left", has_suffix ? separator : "",
      suffix_.data());
  return written(wanted, line.size());
}

void Progress::draw_bar() noexcept {
  const std::size_t columns = std::min(columns_of(descriptor_), kLineBytes - 16) - 1;
  Line state{};
  const std::size_t state_bytes = format_state(state, "  ");
  const std::size_t fixed_columns = std::strlen(label_.data()) + 5 + state_bytes;
  const std::size_t room = columns > fixed_columns ? columns - fixed_columns : 0;
  std::array<char, kMaxBarColumns + 5> bar{" "};
  if (room >= kMinBarColumns && total_ != kEndless) {
    const std::size_t bar_columns = std::min(room, kMaxBarColumns);
    const std::size_t full = bar_columns * percent() / 100;
    bar[1] = '[';
    std::fill_n(bar.begin() + 2, full, '#');
    std::fill_n(bar.begin() + 2 + static_cast<std::ptrdiff_t>(full), bar_columns - full, '.');
    bar[bar_columns + 2] = ']';
    bar[bar_columns + 3] = ' ';
  }
  Line line{};
  const int wanted =
      std::snprintf(line.data(), line.size(), "\r%s%s%s", label_.data(), bar.data(), state.data());
  // Cut to one column less than the terminal has: a full line would scroll on some of them.
  std::size_t bytes = std::min(written(wanted, line.size()), columns + 1);
  bytes = std::min(bytes, line.size() - kClearToEndOfLine.size());
  std::copy(kClearToEndOfLine.begin(), kClearToEndOfLine.end(),
            line.begin() + static_cast<std::ptrdiff_t>(bytes));
  put(line.data(), bytes + kClearToEndOfLine.size());
  bar_on_screen_ = true;
  next_draw_us_ = MonotonicClock::now_us() + kRedrawInterval_us;
}

void Progress::print_plain() noexcept {
  Line state{};
  format_state(state, ", ");
  Line line{};
  const int wanted =
      std::snprintf(line.data(), line.size(), "%s: %s\n", label_.data(), state.data());
  put(line.data(), written(wanted, line.size()));
  plain_done_ = done_;
  next_plain_percent_ = percent() / kPlainStepPercent * kPlainStepPercent + kPlainStepPercent;
}

// A failure to show progress is ignored.
void Progress::put(const char* bytes, std::size_t count) const noexcept {
  while (count > 0) {
    const ssize_t done = ::write(descriptor_, bytes, count);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return;
    bytes += done;
    count -= static_cast<std::size_t>(done);
  }
}

}  // namespace tessera
