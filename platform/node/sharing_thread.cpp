// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/sharing_thread.hpp"

#include <algorithm>

namespace tessera {

Outcome<void> SharingThread::start(const ThreadRole& role, std::int64_t start_us) {
  loop_.begin(start_us);
  now_.quiet_since_us = start_us;
  return thread_.start(
      role, [](void* self) { static_cast<SharingThread*>(self)->run(); }, this);
}

void SharingThread::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  thread_.join();
}

void SharingThread::run() noexcept {
  while (!stopping_.load(std::memory_order_acquire)) {
    const std::int64_t now_us = MonotonicClock::now_us();
    heartbeat_.beat(now_us);
    loop_.receive(now_us);
    if (now_us >= loop_.tick_due_us()) {
      tick(now_us);
      if (each_tick_.call != nullptr) each_tick_.call(each_tick_.context, now_us);
    }
    loop_.send(now_us);
    loop_.wait_until(loop_.tick_due_us());
  }
  sharer_.exchange().leave();
  loop_.send(MonotonicClock::now_us());
  heartbeat_.rest();
}

void SharingThread::tick(std::int64_t now_us) noexcept {
  MappingThreadState mapping;
  const bool knows_mapping = mapping_.state().get(mapping);
  if (knows_mapping) note_place(mapping);
  if (knows_mapping && mapping.cycles != scans_seen_) {
    scans_seen_ = mapping.cycles;
    Matrix34d T_map_body;
    std::copy(mapping.T_map_body.begin(), mapping.T_map_body.end(), T_map_body.data());
    sharer_.note_scan(maps_, mapping.submap, mapping.stamp_us, T_map_body);
  }
  if (const std::uint64_t asked = reopen_.exchange(0, std::memory_order_acquire); asked != 0) {
    // If it is refused, the exchange still reports that it is overtaken.
    static_cast<void>(sharer_.reopen(static_cast<std::uint32_t>(asked >> 32U),
                                     static_cast<std::uint32_t>(asked)));
  }
  note_seen();
  second_.add(loop_.tick(now_us));
  if (knows_mapping) note_teammates(mapping, now_us);
  if (knows_mapping) ask_of_next(mapping, now_us);
  note_frames(now_us);
  note_asked(now_us);
  note_status(now_us);
}

/// By poses, also while nothing is mapped; of a recording there are those of scans alone.
void SharingThread::note_place(const MappingThreadState& mapping) noexcept {
  if (!sharer_.tells_place()) return;
  Matrix34d T_map_body;
  if (sensing_ != nullptr) {
    SensingThreadState sensing;
    if (!sensing_->get(sensing) || sensing.poses == poses_seen_) return;
    poses_seen_ = sensing.poses;
    std::copy(sensing.T_map_body.begin(), sensing.T_map_body.end(), T_map_body.data());
    sharer_.note_place(mapping.submap, sensing.stamp_us, T_map_body, sensing.stamp_us);
  } else if (mapping.cycles != scans_seen_) {
    std::copy(mapping.T_map_body.begin(), mapping.T_map_body.end(), T_map_body.data());
    sharer_.note_place(mapping.submap, mapping.taken_us, T_map_body, mapping.taken_us);
  }
}

void SharingThread::note_teammates(const MappingThreadState& mapping,
                                   std::int64_t now_us) noexcept {
  const std::uint32_t before = teammates_now_.count;
  teammates_now_.take(sharer_, mapping.submap, now_us);
  if (before + teammates_now_.count != 0) teammates_.set(teammates_now_);
}

/// Each scan's answer once.
void SharingThread::note_seen() noexcept {
  const std::uint64_t version = mapping_.seen().version();
  if (version == watched_seen_ || !mapping_.seen().get(watched_now_)) return;
  watched_seen_ = version;
  sharer_.note_watched(watched_now_.all(), watched_now_.taken_us);
}

void SharingThread::ask_of_next(const MappingThreadState& mapping, std::int64_t now_us) noexcept {
  const std::uint32_t before = watched_now_.count;
  watched_now_.submap = mapping.submap;
  watched_now_.count = static_cast<std::uint32_t>(
      sharer_.place_watched(mapping.submap, now_us, watched_now_.points));
  if (before + watched_now_.count != 0) watched_.set(watched_now_);
}

/// Only where the robot itself is somewhere: else all matters alike.
void SharingThread::note_asked(std::int64_t now_us) noexcept {
  if (asked_ == nullptr || scans_seen_ == 0) return;
  const std::uint64_t version = asked_->version();
  const bool is_new = version != asked_seen_ && asked_->get(route_);
  if (is_new) asked_seen_ = version;
  if (!route_.forget_old(now_us) && !is_new) return;
  const std::array<Point3d, Sharer::kMostRoute> places = route_.points();
  sharer_.set_route(std::span(places).first(route_.count));
}

void SubmapFramesState::take(const SubmapFrames& all) noexcept {
  first = all.first();
  revision = all.revision();
  count = std::min<std::uint32_t>(all.last() - all.first() + 1, kMost);
  for (std::uint32_t i = 0; i < count; ++i) frames[i] = all.saved(first + i);
}

void SharingThread::note_frames(std::int64_t now_us) noexcept {
  constexpr std::int64_t kPoses_us = 1'000'000;
  const SubmapFrames& frames = sharer_.frames();
  const std::uint32_t count = frames.last() - frames.first() + 1;
  const std::uint32_t corrections = sharer_.submap().corrections;
  if (count == frames_now_.count && corrections == corrections_seen_ && now_us < frames_due_us_)
    return;
  frames_due_us_ = now_us + kPoses_us;
  corrections_seen_ = corrections;
  frames_now_.take(frames);
  frames_.set(frames_now_);
}

void SharingThread::note_sessions() noexcept {
  now_.session_count = 0;
  const Replicas& replicas = sharer_.global().replicas();
  for (const Replicas::Slot slot : replicas.in_order()) {
    const Replicas::Contribution& one = replicas.contribution(slot);
    if (!MapSession::is(one.id.submap) || one.session.weight == 0) continue;
    const std::span<const MapSession> known = std::span(now_.sessions).first(now_.session_count);
    const bool is_known = std::any_of(known.begin(), known.end(), [&](const MapSession& other) {
      return other.digest == one.session.digest;
    });
    if (!is_known && now_.session_count < now_.sessions.size())
      now_.sessions[now_.session_count++] = one.session;
  }
}

void SharingThread::note_status(std::int64_t now_us) noexcept {
  const ExchangeReport exchange = sharer_.exchange().report();
  const Activity activity{exchange.records_taken, exchange.published_parts,
                          exchange.fresh_chunks + exchange.answer_chunks, exchange.contributions};
  ++now_.ticks;
  now_.exchange = exchange;
  now_.in_reach = now_.matching = 0;
  for (const Peer& peer : sharer_.exchange().peers().all()) {
    now_.in_reach += !peer.left && (Instant::at_us(now_us) - peer.heard).us <= kReach_us ? 1U : 0U;
    now_.matching += peer.mismatch ? 0U : 1U;
  }
  now_.agreeing = sharer_.exchange().peers_agreeing(now_us);
  now_.digest = sharer_.exchange().digest();
  now_.submap = sharer_.submap();
  now_.waiting = sharer_.global().waiting();
  now_.global = sharer_.global().map().usage();
  now_.global_counts = sharer_.global().counters();
  note_sessions();
  const std::optional<std::uint32_t> overtaken = sharer_.exchange().overtaken();
  now_.overtaken = overtaken ? std::uint64_t{*overtaken} + 1 : 0;
  now_.highest_session_heard = sharer_.exchange().epochs().highest_session();
  const std::span<const RobotFloor> floors = sharer_.exchange().epochs().all();
  now_.floor_count = static_cast<std::uint32_t>(std::min(floors.size(), now_.floors.size()));
  std::copy_n(floors.begin(), now_.floor_count, now_.floors.begin());
  now_.floors_refused =
      std::max<std::uint64_t>(now_.floors_refused, floors.size() - now_.floor_count);
  const std::span<const Conflicts::Known> conflicts = sharer_.exchange().conflicts().all();
  for (; now_.conflict_count < conflicts.size(); ++now_.conflict_count)
    now_.conflicts[now_.conflict_count] = conflicts[now_.conflict_count].id;
  now_.idle = sharer_.idle();
  if (!now_.idle || activity != activity_) now_.quiet_since_us = now_us;
  activity_ = activity;
  state_.set(now_);
}

}  // namespace tessera
