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

bool PeerTable::is_new(const Peer& peer, std::uint32_t session, std::uint32_t sequence) noexcept {
  if (session != peer.session || peer.window == 0) return session >= peer.session;
  if (sequence > peer.sequence) return true;
  const std::uint32_t behind = peer.sequence - sequence;
  return behind < kWindow && (peer.window >> behind & 1U) == 0;
}

void PeerTable::note(Peer& peer, std::uint32_t session, std::uint32_t sequence) noexcept {
  if (session != peer.session || peer.window == 0) {
    peer.session = session;
    peer.sequence = sequence;
    peer.window = 1;
    return;
  }
  if (sequence > peer.sequence) {
    const std::uint32_t ahead = sequence - peer.sequence;
    peer.window = ahead < kWindow ? peer.window << ahead | 1U : 1U;
    peer.sequence = sequence;
    return;
  }
  peer.window |= std::uint64_t{1} << (peer.sequence - sequence);
}

bool PeerTable::note_data(Peer& peer, std::uint32_t session, std::uint32_t sequence) noexcept {
  const bool later = session > peer.data_session ||
                     (session == peer.data_session && sequence > peer.data_sequence);
  if (!later) return false;
  peer.data_session = session;
  peer.data_sequence = sequence;
  return true;
}

}  // namespace tessera
