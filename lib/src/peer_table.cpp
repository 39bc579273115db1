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

bool PeerTable::is_new(Peer& peer, std::uint32_t session, std::uint32_t sequence) noexcept {
  if (session < peer.session) return false;
  if (session > peer.session || peer.window == 0) {
    peer.session = session;
    peer.sequence = sequence;
    peer.window = 1;
    return true;
  }
  if (sequence > peer.sequence) {
    const std::uint32_t ahead = sequence - peer.sequence;
    peer.window = ahead < kWindow ? peer.window << ahead | 1U : 1U;
    peer.sequence = sequence;
    return true;
  }
  const std::uint32_t behind = peer.sequence - sequence;
  if (behind >= kWindow) return false;
  const std::uint64_t bit = std::uint64_t{1} << behind;
  if ((peer.window & bit) != 0) return false;
  peer.window |= bit;
  return true;
}

}  // namespace tessera
