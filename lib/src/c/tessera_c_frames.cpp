// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The C interface: the transform between two maps.
#include <algorithm>

#include "tessera/base/rigid.hpp"
#include "tessera/frames/search_reach.hpp"
#include "tessera_c.hpp"

using namespace tessera;
using namespace tessera::c_interface;

struct tessera_frame_finder {
  static constexpr std::uint64_t kMagic = 0x74657373'6672'6d01U;
  std::uint64_t magic = 0;
  FrameFinder finder{};
  bool has_begun = false;
  bool is_done = false;
};

namespace {

constexpr std::size_t kFinderBytes =
    arena_bytes<tessera_frame_finder>(1) + FrameFinder::required_bytes();

bool is_finder(const tessera_frame_finder* finder) noexcept {
  return finder != nullptr &&
         reinterpret_cast<std::uintptr_t>(finder) % alignof(tessera_frame_finder) == 0 &&
         finder->magic == tessera_frame_finder::kMagic;
}

/// As MapIdentity::is_placed() and place() of the file that would be saved.
bool is_placed(const tessera_robot& robot, std::uint32_t map) noexcept {
  return map != TESSERA_LOCAL_MAP || robot.robot->sharer().is_placed();
}
Matrix34d frame_of(const tessera_robot& robot, std::uint32_t map) noexcept {
  return map == TESSERA_LOCAL_MAP ? frame_of_local(robot) : Matrix34d(Matrix34d::Identity());
}

tessera_agreement agreement_of(const Agreement& from) noexcept {
  return {.agreed = from.agreed,
          .contradicted = from.contradicted,
          .unseen = from.unseen,
          .flat_agreed = from.flat_agreed,
          .flat_contradicted = from.flat_contradicted,
          .labelled = from.labelled,
          .same_label = from.same_label,
          .reserved = 0};
}

}  // namespace

extern "C" {

tessera_status tessera_placed_robot_at(const tessera_robot* robot, uint32_t index,
                                       tessera_placed_robot* placed) {
  if (!is_robot(robot) || !can_fill(placed)) return TESSERA_INVALID_ARGUMENT;
  const SharedFrames* const frames = robot->robot->sharer().shared_frames();
  if (frames == nullptr || index >= frames->robots().size()) return TESSERA_OUT_OF_RANGE;
  const PlacedRobot& from = frames->robots()[index];
  tessera_placed_robot filled{};
  filled.robot = from.robot;
  filled.group = from.frame.group;
  filled.anchor = from.frame.anchor;
  filled.state = static_cast<std::uint32_t>(from.frame.state);
  filled.in_use = from.follower.in_use() ? 1U : 0U;
  filled.arrived = from.follower.arrived() ? 1U : 0U;
  filled.suspected = from.frame.suspected ? 1U : 0U;
  std::copy_n(from.follower.frame().data(), 12, filled.T_team_map);
  filled.sigma_m = from.frame.covariance.sigma_m();
  filled.sigma_rad = from.frame.covariance.sigma_rad();
  fill(filled, placed);
  return TESSERA_OK;
}

const char* tessera_frame_verdict_text(uint32_t verdict) {
  return to_string(static_cast<FrameVerdict>(verdict > UINT8_MAX ? UINT8_MAX : verdict));
}

tessera_status tessera_frame_finder_bytes(uint64_t* bytes) {
  if (bytes == nullptr) return TESSERA_INVALID_ARGUMENT;
  *bytes = kFinderBytes;
  return TESSERA_OK;
}

tessera_status tessera_frame_finder_make(void* memory, uint64_t bytes,
                                         tessera_frame_finder** finder) {
  if (memory == nullptr || finder == nullptr ||
      reinterpret_cast<std::uintptr_t>(memory) % TESSERA_ALIGNMENT != 0)
    return TESSERA_INVALID_ARGUMENT;
  if (bytes < kFinderBytes) return TESSERA_RESOURCE_EXHAUSTED;
  Arena arena({static_cast<std::byte*>(memory), kFinderBytes});
  tessera_frame_finder& made = arena.take<tessera_frame_finder>(1).front();
  if (const Status status = FrameFinder::make_at(made.finder, arena); status != Status::kOk)
    return status_of(status);
  made.magic = tessera_frame_finder::kMagic;
  *finder = &made;
  return TESSERA_OK;
}

tessera_status tessera_frame_finder_begin(tessera_frame_finder* finder, const tessera_robot* a,
                                          uint32_t map_a, const tessera_robot* b, uint32_t map_b,
                                          const double* T_a_b_guess) {
  if (!is_finder(finder) || !is_robot(a) || !is_robot(b) || !is_map(map_a) || !is_map(map_b))
    return TESSERA_INVALID_ARGUMENT;
  if (!is_settled(*a, map_a) || !is_settled(*b, map_b)) return TESSERA_BUSY;
  std::optional<Matrix34d> guess;
  if (T_a_b_guess != nullptr) guess = matrix_of(T_a_b_guess);
  FrameQuestion question = question_of(guess);
  if (!guess && is_placed(*a, map_a) && is_placed(*b, map_b))
    question.T_a_b_guess = between_frames(frame_of(*a, map_a), frame_of(*b, map_b));
  const Status status = finder->finder.begin(map_of(*a, map_a), map_of(*b, map_b), question);
  if (status != Status::kOk) return status_of(status);
  finder->has_begun = true;
  finder->is_done = false;
  return TESSERA_OK;
}

tessera_status tessera_frame_finder_step(tessera_frame_finder* finder, uint32_t* state) {
  if (!is_finder(finder) || state == nullptr || !finder->has_begun) return TESSERA_INVALID_ARGUMENT;
  finder->is_done = finder->finder.step();
  *state = finder->finder.taken_in() ? TESSERA_FRAME_SEARCHING : TESSERA_FRAME_READING;
  if (finder->is_done) *state = TESSERA_FRAME_DONE;
  return TESSERA_OK;
}

tessera_status tessera_frame_finder_answer(const tessera_frame_finder* finder,
                                           tessera_frame_answer* answer) {
  if (!is_finder(finder) || !can_fill(answer) || !finder->has_begun)
    return TESSERA_INVALID_ARGUMENT;
  if (!finder->is_done) return TESSERA_BUSY;
  const FrameAnswer& from = finder->finder.answer();
  tessera_frame_answer filled{};
  filled.verdict = static_cast<std::uint32_t>(from.verdict);
  for (int i = 0; i < 12; ++i) filled.T_a_b[i] = from.T_a_b(i / 4, i % 4);
  std::copy(from.covariance.begin(), from.covariance.end(), filled.covariance);
  for (int axis = 0; axis < 3; ++axis) filled.middle_a[axis] = from.middle_a[axis];
  filled.sigma_m = from.worst_sigma_m;
  filled.sigma_rad = from.worst_sigma_rad;
  filled.support = from.support;
  filled.support_second = from.support_second;
  filled.agreement = agreement_of(from.agreement);
  filled.agreement_second = agreement_of(from.agreement_second);
  filled.agreement_guess = agreement_of(from.agreement_guess);
  filled.pairs = from.pairs;
  filled.steps = finder->finder.steps();
  fill(filled, answer);
  return TESSERA_OK;
}

}  // extern "C"
