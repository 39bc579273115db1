// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/log.hpp"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <string_view>

namespace tessera {

namespace {

/// A line under construction; what does not fit is left out.
class Line {
 public:
  void put(std::string_view text) noexcept {
    const std::size_t room = kMost - size_;
    const std::size_t count = std::min(room, text.size());
    std::memcpy(&bytes_[size_], text.data(), count);
    size_ += count;
  }
  void put(std::int64_t number) noexcept {
    std::array<char, 24> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
    put(std::string_view(digits.data(), static_cast<std::size_t>(end - digits.data())));
  }
  [[nodiscard]] std::string_view end() noexcept {
    bytes_[size_++] = '\n';
    return {bytes_.data(), size_};
  }

 private:
  static constexpr std::size_t kMost = 255;
  std::array<char, kMost + 1> bytes_{};
  std::size_t size_ = 0;
};

}  // namespace

void LogWriter::write(std::span<LogQueue* const> queues) noexcept {
  int left = kMostRecords;
  for (LogQueue* const queue : queues) {
    for (const LogRecord* record = queue->queue_.front(); record != nullptr && left > 0; --left) {
      write(queue->name_, *record);
      queue->queue_.pop();
      record = queue->queue_.front();
    }
    const std::uint64_t lost = queue->lost();
    if (lost == queue->told_lost_) continue;
    const std::array<std::int64_t, 1> count{static_cast<std::int64_t>(lost - queue->told_lost_)};
    queue->told_lost_ = lost;
    put_line(LogLevel::kWarning, queue->name_, "% messages lost, as the queue was full", count, 0);
  }
}

/// The record of this text, or the place of the one that was not logged for longest.
LogWriter::Said& LogWriter::said(const LogRecord& record) noexcept {
  Said* oldest = &said_[0];
  for (Said& one : said_) {
    if (one.text == record.text) return one;
    if (one.text == nullptr || (oldest->text != nullptr && one.last_us < oldest->last_us))
      oldest = &one;
  }
  *oldest = {record.text, record.stamp_us - kQuiet_us, 0};
  return *oldest;
}

void LogWriter::write(const char* name, const LogRecord& record) noexcept {
  Said& before = said(record);
  if (!record.is_change && record.stamp_us - before.last_us < kQuiet_us) {
    ++before.held_back;
    return;
  }
  put_line(record.level, name, record.text, record.numbers, before.held_back);
  before.last_us = record.stamp_us;
  before.held_back = 0;
}

void LogWriter::put_line(LogLevel level, const char* name, const char* text,
                         std::span<const std::int64_t> numbers, std::uint64_t times) noexcept {
  Line line;
  if (prefixed_) {
    line.put("<");
    line.put(static_cast<std::int64_t>(level));
    line.put(">");
  }
  line.put(name);
  line.put(level == LogLevel::kInfo      ? ": "
           : level == LogLevel::kWarning ? ": warning: "
                                         : ": error: ");
  std::size_t next = 0;
  for (const char* at = text; *at != '\0'; ++at) {
    if (*at == '%' && next < numbers.size()) {
      line.put(numbers[next++]);
    } else {
      line.put(std::string_view(at, 1));
    }
  }
  if (times > 0) {
    line.put(" (");
    line.put(static_cast<std::int64_t>(times));
    line.put(" more of these before)");
  }
  const std::string_view bytes = line.end();
  if (::write(descriptor_, bytes.data(), bytes.size()) > 0) ++lines_;
}

}  // namespace tessera
