// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Submaps that earlier starts have mapped and that nobody has any more, as the robot was alone or
// all robots were restarted: they are published again, from their files, one after the other.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "maps/stored_map.hpp"
#include "tessera/robot/sharer.hpp"
#include "tessera/submap/submap_file.hpp"

namespace tessera {

class EarlierSubmaps {
 public:
  /// From the start on, others may still send what they have; and after each record that came.
  static constexpr std::int64_t kPatience_us = 20'000'000;
  static constexpr std::int64_t kQuiet_us = 5'000'000;
  static constexpr std::size_t kBlocksOfTick = 32;
  /// In one look, a second after the one before.
  static constexpr std::size_t kLookedAt = 32;

  /// stem: of their files (KeptSubmaps).
  EarlierSubmaps(std::string stem, std::span<const SubmapRow> rows);

  /// In the sharing thread, after each tick. records: that were taken since the start. Publishes at
  /// most kBlocksOfTick blocks.
  void tick(Sharer& sharer, std::int64_t now_us, std::uint64_t records) noexcept;
  /// In a thread that may wait for the disk and use the heap: reads the file that is wanted. Fails
  /// as load_map; that submap is then left out.
  Outcome<void> look();

  /// Submaps that were published again.
  [[nodiscard]] std::uint32_t published() const noexcept {
    return published_.load(std::memory_order_relaxed);
  }

 private:
  /// What the first thread has read for the other one.
  struct Job {
    std::size_t at = 0;  ///< In numbers_.
    std::unique_ptr<StoredMap> stored;
    std::vector<KeyedIndex> workspace{};
    std::span<const KeyedIndex> blocks{};
  };
  void work_on(Sharer& sharer, const Job& job) noexcept;
  void want_next(const Sharer& sharer) noexcept;

  std::string stem_;
  std::vector<std::uint32_t> numbers_;
  std::vector<std::atomic<bool>> done_;  ///< Of each of them: tried, or not wanted.
  std::unique_ptr<Job> job_;             ///< Of the thread that reads.
  std::atomic<const Job*> handed_{nullptr};
  std::atomic<std::size_t> wanted_{0};  ///< A place in numbers_ plus one; 0: none.
  std::atomic<std::uint32_t> published_{0};
  // Of the sharing thread.
  std::size_t block_ = 0;
  std::int64_t begun_us_ = 0;
  std::int64_t heard_us_ = 0;
  std::int64_t due_us_ = 0;
  std::uint64_t records_ = 0;
  std::size_t next_ = 0;
};

}  // namespace tessera
