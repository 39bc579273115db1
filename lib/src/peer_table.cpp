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

Peer* PeerTable::find_or_add(std::uint32_t robot, std::int64_t now_us) noexcept {
  const std::span<Peer> known = peers_.first(count_);
  const auto same = std::find_if(known.begin(), known.end(),
                                 [robot](const Peer& peer) { return peer.robot == robot; });
  if (same != known.end()) return &*same;
  Peer* place = nullptr;
  if (count_ < peers_.size()) {
    place = &peers_[count_++];
  } else {
    place = &*std::min_element(known.begin(), known.end(), [](const Peer& a, const Peer& b) {
      return a.heard_us < b.heard_us;
    });
    if (now_us - place->heard_us < kSilentUs) return nullptr;
  }
  *place = {};
  place->robot = robot;
  place->heard_us = now_us;
  return place;
}

bool SequenceWindow::is_new(std::uint32_t of_session, std::uint32_t number) const noexcept {
  if (of_session != session || heard == 0) return of_session >= session;
  if (number > sequence) return true;
  const std::uint32_t behind = sequence - number;
  return behind < kSize && (heard >> behind & 1U) == 0;
}

void SequenceWindow::note(std::uint32_t of_session, std::uint32_t number) noexcept {
  if (of_session != session || heard == 0) {
    session = of_session;
    sequence = number;
    heard = 1;
    return;
  }
  if (number > sequence) {
    const std::uint32_t ahead = number - sequence;
    heard = ahead < kSize ? heard << ahead | 1U : 1U;
    sequence = number;
    return;
  }
  heard |= std::uint64_t{1} << (sequence - number);
}

}  // namespace tessera
