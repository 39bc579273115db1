// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which process of a robot is there now: its session, its sequence numbers, and challenges.
#include <algorithm>

#include "tessera/base/internal/bits.hpp"
#include "tessera/exchange/internal/gate.hpp"

namespace tessera {

namespace {

/// Between two challenges of one robot, and within which its answer counts.
constexpr Duration kBetweenChallenges{1'000'000};
constexpr Duration kProofTime{5'000'000};
/// Between two starts of a robot after which it may ask for everything again: at first, and at
/// most.
constexpr Duration kRenewTime{60'000'000};
constexpr Duration kMostRenewTime{3'600'000'000};
/// Without a higher sequence number for so long somebody else may have used up a robot's numbers.
constexpr Duration kStalledTime{2'500'000};
/// A number whose process is proved to be another one again within this is used by two.
constexpr Duration kTwinTime{20'000'000};

/// In place of a nonce that is drawn when it is sent.
constexpr std::uint64_t kUndrawn = 2;

constexpr std::uint32_t start_of(std::uint64_t session) noexcept {
  return static_cast<std::uint32_t>(session >> 32U);
}

/// A process that starts empty may ask for everything, as a newcomer does. A robot that says again
/// and again that it has started may do so less and less often.
void renew_allowance(Peer& peer, Instant now) noexcept {
  if (now - peer.allowance_renewed <= peer.allowance_pause) return;
  peer.allowance_at = Instant::long_ago();
  peer.allowance_renewed = now;
  peer.allowance_pause = std::clamp(2 * peer.allowance_pause, kRenewTime, kMostRenewTime);
}

}  // namespace

bool Gate::proves_itself(const Heard& heard) const noexcept {
  const Peer& peer = *heard.peer;
  if (heard.header.kind != DatagramKind::kAnnounce || peer.nonce == 0 ||
      heard.now - peer.challenged > kProofTime)
    return false;
  const auto& header = heard.announcement;
  const auto all = std::span(header.challenge).first(header.challenges);
  return std::any_of(all.begin(), all.end(), [&](const Challenge& one) {
    return one.is_answer && one.robot == robot_ && one.nonce == peer.nonce;
  });
}

/// A later start is taken as it is. Any other session than the one at work may be a recording, or
/// of a robot whose counter was lost, or whose number somebody forged a later session for: who
/// answers a nonce is there now. Without signatures the same holds for sequence numbers that are
/// not the next ones.
bool Gate::check_session(Heard& heard, Instant now, ExchangeReport& counted) noexcept {
  Peer& peer = *heard.peer;
  const DatagramHeader& header = heard.header;
  const bool is_other = peer.control.is_of_another(header.session);
  const bool is_next = peer.control.heard == 0 || header.sequence > peer.control.sequence;
  if (!is_other && (is_next || signatures_.on())) return true;
  if (is_other && start_of(header.session) > start_of(peer.control.session)) {
    renew_allowance(peer, now);
    return true;
  }
  if (proves_itself(heard)) {
    if (is_other) {
      renew_allowance(peer, now);
      counted.twins += now - peer.session_changed < kTwinTime ? 1U : 0U;
      peer.session_changed = now;
    }
    peer.nonce = 0;
    peer.control = {};
    return true;
  }
  // A robot whose numbers go on is not asked because some come late or twice.
  if (is_other || now - peer.advanced > kStalledTime) {
    if (peer.nonce == 0) peer.nonce = kUndrawn;
    peer.doubted = now;
  }
  if (!is_other && peer.control.is_new(header.sequence)) return true;
  // It may refuse what this robot says for the same reason: then only an answer ends that. A
  // recording takes no answer's place.
  if (header.kind == DatagramKind::kAnnounce && peer.answer == 0) note_challenges(heard);
  return refuse(counted.refused_replay);
}

/// A number above the one that the sender has come to was somebody else's: what the sender says
/// next would not be its last word.
void Gate::note_data_sequence(const Heard& heard) noexcept {
  SequenceWindow& window = heard.peer->data;
  const std::uint64_t sequence = heard.announcement.data_sequence;
  if (!window.is_of_another(heard.header.session) && window.sequence <= sequence) return;
  window = {};
  if (sequence != 0) window.note(heard.header.session, sequence);
}

void Gate::note_challenges(const Heard& heard) const noexcept {
  const auto& header = heard.announcement;
  for (const Challenge& one : std::span(header.challenge).first(header.challenges)) {
    if (!one.is_answer && one.robot == robot_) heard.peer->answer = one.nonce;
  }
}

bool Gate::wants_to_announce(Instant now) const noexcept {
  const auto all = peers_.all();
  return std::any_of(all.begin(), all.end(), [now](const Peer& peer) {
    return peer.answer != 0 || (peer.nonce != 0 && now - peer.doubted <= kProofTime &&
                                now - peer.challenged > kBetweenChallenges);
  });
}

void Gate::write_challenges(AnnouncementHeader& header, Instant now,
                            std::uint64_t random) noexcept {
  for (Peer& peer : peers_.all()) {
    const auto add = [&](bool is_answer, std::uint64_t nonce) {
      if (header.challenges == AnnouncementHeader::kMostChallenges) return false;
      header.challenge[header.challenges++] = {is_answer, peer.robot, nonce};
      return true;
    };
    if (peer.answer != 0 && add(true, peer.answer)) peer.answer = 0;
    // It said nothing more that would need an answer.
    if (now - peer.doubted > kProofTime) peer.nonce = 0;
    if (peer.nonce == 0 || now - peer.challenged <= kBetweenChallenges) continue;
    // The same until it is answered: the answer may be on its way.
    const std::uint64_t nonce =
        peer.nonce == kUndrawn ? mix64(random + peer.robot) | 1U : peer.nonce;
    if (!add(false, nonce)) continue;
    peer.nonce = nonce;
    peer.challenged = now;
  }
}

}  // namespace tessera
