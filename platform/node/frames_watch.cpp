// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/frames_watch.hpp"

namespace tessera {

namespace {

const FramesState::Robot* find_in(const FramesState& state, std::uint32_t robot) noexcept {
  for (std::uint32_t i = 0; i < state.robot_count; ++i)
    if (state.robots[i].robot == robot) return &state.robots[i];
  return nullptr;
}

/// A log line has static text.
const char* placed_text(FrameState state) noexcept {
  switch (state) {
    case FrameState::kGiven:
      return "robot %: its frame is given exactly; the team is in that of robot %";
    case FrameState::kPlaced:
      return "robot %: its frame is given roughly, and no link corrects it; anchor: robot %";
    case FrameState::kLinked:
      return "robot %: its frame is found, in that of robot %";
    case FrameState::kOnlyByOne:
      return "robot %: its frame is found by one robot alone, in that of robot %";
    default:
      return "robot %: its frame is its own, as nothing joins it to others; anchor: robot %";
  }
}

}  // namespace

void FramesWatch::look(const Sharer& sharer, std::uint32_t own_robot, std::int64_t now_us,
                       LogQueue& log) noexcept {
  if (now_us < due_us_) return;
  due_us_ = now_us + kPause_us;
  const SharedFrames* const frames = sharer.shared_frames();
  if (frames == nullptr) return look_given(sharer.global().replicas(), own_robot, now_us, log);
  now_.take(*frames);
  for (std::uint32_t i = 0; i < now_.robot_count; ++i)
    tell(now_.robots[i], find_in(last_, now_.robots[i].robot), now_us, log);
  for (std::uint32_t i = 0; i < last_.robot_count; ++i) {
    const FramesState::Robot& gone = last_.robots[i];
    if (gone.in_use && find_in(now_, gone.robot) == nullptr)
      log.say_change(LogLevel::kInfo, now_us, "robot % has left, and so has its frame", gone.robot);
  }
  last_ = now_;
  view_.set(now_);
}

void FramesWatch::look_given(const Replicas& replicas, std::uint32_t own_robot, std::int64_t now_us,
                             LogQueue& log) noexcept {
  now_.take_given(replicas, own_robot);
  if (now_.left_out_by != 0 && !has_told_)
    log.say_change(LogLevel::kWarning, now_us,
                   "frames are given here, but found by other robots (%): these leave this robot's "
                   "map out, and theirs are left out here; set frames alike on all robots",
                   now_.left_out_by);
  has_told_ = has_told_ || now_.left_out_by != 0;
  if (now_.left_out_by != last_.left_out_by) view_.set(now_);
  last_.left_out_by = now_.left_out_by;
}

void FramesWatch::tell(const FramesState::Robot& robot, const FramesState::Robot* before,
                       std::int64_t now_us, LogQueue& log) noexcept {
  const bool was_used = before != nullptr && before->in_use;
  const bool is_held_alike =
      was_used && before->anchor == robot.anchor && before->state == robot.state;
  if (robot.in_use && !is_held_alike) {
    log.say_change(LogLevel::kInfo, now_us, placed_text(robot.state), robot.robot, robot.anchor);
  } else if (was_used && !robot.in_use) {
    log.say_change(LogLevel::kWarning, now_us,
                   robot.state == FrameState::kContradicted
                       ? "robot %: its frame is withdrawn, as links contradict each other; its map "
                         "is left out"
                       : "robot %: its frame is withdrawn, and its map is left out",
                   robot.robot);
  }
  if (robot.suspected && (before == nullptr || !before->suspected))
    log.say_change(LogLevel::kWarning, now_us,
                   "robot %: its links contradict what others confirm; its map may be bent",
                   robot.robot);
}

}  // namespace tessera
