// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Loads the configured maps of earlier days, one after the other, and has them shared: the first
// thread reads a file, the sharing thread publishes its blocks in slices. Which of them are wanted
// may change while the node runs.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/json.hpp"
#include "maps/session_file.hpp"
#include "tessera/robot/sharer.hpp"

namespace tessera {

class SessionLoader {
 public:
  static constexpr std::size_t kBlocksOfTick = 64;

  explicit SessionLoader(const std::vector<SessionOptions>& wanted);

  // --- In the sharing thread ---------------------------------------------------------------------

  /// After each tick. Publishes at most kBlocksOfTick blocks. Once all that is wanted is shared or
  /// left out, sessions of earlier starts end.
  void tick(Sharer& sharer) noexcept;

  /// For any thread: nothing is left to be loaded, removed or published.
  [[nodiscard]] bool is_settled() const noexcept {
    return is_loaded() && handed_.load(std::memory_order_acquire) == nullptr;
  }

  // --- In a thread that may wait for the disk and use the heap -----------------------------------

  /// Reads the next file, or takes what became of the last one. A line for the log, if there is
  /// one. map, classes: of the robot.
  struct News {
    bool is_error = false;
    std::string text{};
  };
  [[nodiscard]] News look(const MapConfig& map, const ClassTable& classes);
  /// What is wanted from now on: others are removed, new ones are loaded.
  void want(const std::vector<SessionOptions>& wanted);
  /// For the report, once the sharing thread has ended, or in the thread that calls look().
  [[nodiscard]] Json report() const;

 private:
  enum class State : std::uint8_t { kWaiting, kShared, kLeftOut, kUnwanted };
  struct Item {
    SessionOptions options;
    State state = State::kWaiting;
    MapSession session{};
    std::uint32_t submap = 0;  ///< Its number, once it is shared.
    std::uint32_t blocks = 0;
    std::uint32_t refused_blocks = 0;
    std::string why{};  ///< It was left out.
  };
  /// What one thread asks the other for, and what came of it.
  struct Job {
    std::size_t item = 0;
    bool removes = false;
    std::uint32_t submap = 0;
    SessionFile file{};
    std::size_t next_block = 0;
    bool is_open = false;
    Status status = Status::kOk;
    MapSessions::Session done{};
  };
  [[nodiscard]] bool is_loaded() const noexcept {
    return loaded_for_.load(std::memory_order_acquire) ==
           std::uint64_t{epochs_.load(std::memory_order_acquire)} + 1;
  }
  [[nodiscard]] News begin(std::size_t item, const MapConfig& map, const ClassTable& classes);
  [[nodiscard]] News take_result();
  [[nodiscard]] News leave_out(Item& item, std::string why);
  void hand(std::unique_ptr<Job> job);
  void work_on(Sharer& sharer, Job& job) noexcept;
  void end_job(Job& job, Status status) noexcept;

  std::vector<Item> items_;
  std::unique_ptr<Job> job_;  ///< Of the thread that reads, but while it is handed over.
  std::atomic<Job*> handed_{nullptr};
  std::atomic<std::uint32_t> epochs_{0};  ///< Changes of the epoch: all is to be loaded again.
  /// One more than the epochs_ for which nothing waits to be loaded: so it never is of another one.
  std::atomic<std::uint64_t> loaded_for_{0};
  std::uint32_t epochs_seen_ = 0;
  bool has_ended_earlier_ = false;  ///< Of the sharing thread.
};

}  // namespace tessera
