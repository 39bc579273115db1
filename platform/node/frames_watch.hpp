// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Frames that a team finds, in the log and for other threads.
#pragma once

#include <cstdint>

#include "base/latest_value.hpp"
#include "base/log.hpp"
#include "maps/frames_state.hpp"
#include "tessera/robot/sharer.hpp"

namespace tessera {

/// One thread calls look(). No heap.
class FramesWatch {
 public:
  static constexpr std::int64_t kPause_us = 500'000;

  /// mode: as the robot finds its frame, before the first look().
  explicit FramesWatch(FrameMode mode) noexcept {
    now_.mode = mode;
    view_.set(now_);
  }

  /// Logs a line when a robot's frame is found, changes how it is held, or is withdrawn; and, where
  /// frames are given, when others are first seen to find theirs.
  void look(const Sharer& sharer, std::uint32_t own_robot, std::int64_t now_us,
            LogQueue& log) noexcept;
  /// For any thread: as of the last look().
  [[nodiscard]] FramesState view() const noexcept {
    FramesState view;
    static_cast<void>(view_.get(view));
    return view;
  }

 private:
  void look_given(const Replicas& replicas, std::uint32_t own_robot, std::int64_t now_us,
                  LogQueue& log) noexcept;
  void tell(const FramesState::Robot& robot, const FramesState::Robot* before, std::int64_t now_us,
            LogQueue& log) noexcept;

  FramesState last_;
  FramesState now_;
  std::int64_t due_us_ = 0;
  bool has_told_ = false;  ///< That others find frames.
  LatestValue<FramesState> view_;
};

}  // namespace tessera
