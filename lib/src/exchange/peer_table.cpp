// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/peer_table.hpp"

#include <algorithm>

namespace tessera {

Result<PeerTable> PeerTable::make(Arena& arena, std::uint32_t peers) noexcept {
  PeerTable table;
  table.peers_ = arena.take<Peer>(peers);
  if (table.peers_.empty()) return Status::kResourceExhausted;
  return table;
}

Peer* PeerTable::find(std::uint32_t robot) const noexcept {
  for (Peer& peer : peers_.first(count_)) {
    if (peer.robot == robot) return &peer;
  }
  return nullptr;
}

Peer* PeerTable::find_or_add(std::uint32_t robot, Instant now, Duration silent) noexcept {
  if (Peer* const known = find(robot); known != nullptr) return known;
  Peer* place = nullptr;
  if (count_ < peers_.size()) {
    place = &peers_[count_++];
  } else {
    const std::span<Peer> known = peers_.first(count_);
    place = &*std::min_element(known.begin(), known.end(),
                               [](const Peer& a, const Peer& b) { return a.heard < b.heard; });
    if (now - place->heard < silent) return nullptr;
  }
  *place = {};
  place->robot = robot;
  place->heard = now;
  return place;
}

bool SequenceWindow::is_new(std::uint64_t number) const noexcept {
  if (heard == 0 || number > sequence) return true;
  const std::uint64_t behind = sequence - number;
  return behind < kSize && (heard >> behind & 1U) == 0;
}

void SequenceWindow::note(std::uint64_t of_session, std::uint64_t number) noexcept {
  if (of_session != session || heard == 0) {
    session = of_session;
    sequence = number;
    heard = 1;
    return;
  }
  if (number > sequence) {
    const std::uint64_t ahead = number - sequence;
    heard = ahead < kSize ? heard << ahead | 1U : 1U;
    sequence = number;
    return;
  }
  heard |= std::uint64_t{1} << (sequence - number);
}

bool RateLimit::pass(std::int64_t per_s, Instant now, Duration most) noexcept {
  const std::int64_t elapsed_us = std::clamp<std::int64_t>((now - last).us, 0, most.us);
  credit_us = last == Instant::long_ago() ? most.us : std::min(most.us, credit_us + elapsed_us);
  last = now;
  const std::int64_t cost_us = 1'000'000 / per_s;
  if (credit_us < cost_us) return false;
  credit_us -= cost_us;
  return true;
}

}  // namespace tessera
