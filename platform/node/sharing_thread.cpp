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
  if (mapping_.state().get(mapping) && mapping.cycles != scans_seen_) {
    scans_seen_ = mapping.cycles;
    const auto& T = mapping.T_map_sensor;
    sharer_.set_focus({T[3], T[7], T[11]});
  }
  if (const std::uint64_t asked = reopen_.exchange(0, std::memory_order_acquire); asked != 0) {
    // If it is refused, the exchange still reports that it is overtaken.
    static_cast<void>(sharer_.reopen(static_cast<std::uint32_t>(asked >> 32U),
                                     static_cast<std::uint32_t>(asked)));
  }
  second_.add(loop_.tick(now_us));
  note_status(now_us);
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
  now_.waiting = sharer_.global().waiting();
  now_.global = sharer_.global().map().usage();
  now_.global_counts = sharer_.global().counters();
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
