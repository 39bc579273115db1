// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/announcement_taker.hpp"

#include <algorithm>

namespace tessera {

namespace {

/// Between two times that a proof is sent because somebody lacks it; the accused robot itself may
/// only pretend to.
constexpr Duration kBetweenProofs{500'000};
constexpr Duration kBetweenAccusations{8'000'000};

/// A frame may arrive before an announcement that was sent before it.
constexpr Duration kOvertaken{1'000'000};

/// Whether a robot holds the same as this one shows in what it announces, a part at a time.
void note_agreement(const ExchangeParts& parts, const Heard& heard,
                    const AnnouncedContribution& announced) noexcept {
  const Ledger::Contribution* const known = parts.ledger.find(announced.id);
  const FarContribution* const far = parts.ledger.far().find(announced.id);
  const bool same = announced.complete &&
                    ((known != nullptr && known->open && known->complete() &&
                      announced.digest == known->held.folded()) ||
                     (known != nullptr && known->is_far() &&
                      announced.digest == known->statement.fingerprint.folded()) ||
                     (far != nullptr && announced.digest == far->statement.fingerprint.folded()));
  if (!same) heard.peer->differed = heard.now;
  const Ledger::Contribution* const publishing = parts.ledger.publishing();
  if (same && (known == publishing || publishing == nullptr)) heard.peer->agreed = heard.now;
}

/// Of this process: somebody holds something else than it published. It is a claim only, and what
/// was stated shows whether it is true.
void hear_own(const ExchangeParts& parts, const Heard& heard,
              const AnnouncedContribution& announced) noexcept {
  const Ledger::Contribution* const own = parts.ledger.find(announced.id);
  const bool more = own == nullptr || announced.latest > own->latest;
  const bool other = own != nullptr && announced.complete && announced.latest == own->latest &&
                     announced.digest != own->held.folded();
  parts.counted.impostors += more && !parts.gate.signatures().on() ? 1U : 0U;
  if ((more || other) && announced.stated)
    parts.repair.note_claim(announced.id, *heard.peer, heard.now);
}

/// What a robot says last of its own contribution.
void hear_robot_itself(const ExchangeParts& parts, Instant now,
                       const AnnouncedContribution& announced,
                       Ledger::Contribution& contribution) noexcept {
  contribution.listed = now;
  if (!announced.origin) return;
  contribution.origin_at = now;
  // A later frame is somebody else's, unless it overtook the announcement.
  const bool is_lower =
      announced.frame_revision != 0 && announced.frame_revision < contribution.frame_revision;
  if (is_lower && !parts.gate.signatures().on() && now - contribution.frame_at > kOvertaken)
    contribution.frame_doubted = true;
}

void hear_far(const ExchangeParts& parts, const Heard& heard,
              const AnnouncedContribution& announced, FarContribution& far) noexcept {
  if (announced.id.robot == heard.header.sender && heard.is_last) {
    far.listed = heard.now;
    if (announced.origin) far.origin_at = heard.now;
  }
  if (far.is_behind(announced)) parts.repair.note_behind(far, *heard.peer, heard.now);
}

}  // namespace

bool AnnouncementTaker::hear(const ExchangeParts& parts, const Heard& heard) noexcept {
  AnnouncedContribution announced;
  ByteReader all(heard.body);
  std::optional<std::uint32_t> epoch;
  bool ends_in_own = true;  // the list may be cut short
  while (all.remaining() != 0) {
    if (!read_announced(all, announced)) return false;
    const bool own = announced.id.robot == heard.header.sender;
    if (own && announced.origin) epoch = std::max(epoch.value_or(0), announced.id.epoch);
    ends_in_own = own;
  }
  const std::size_t taken = AnnouncementHeader::kMostBytes + AnnouncedContribution::kBytes +
                            (heard.presence ? Presence::kBytes : 0);
  const bool is_whole = !ends_in_own || heard.body.size() + taken < kMostBodyBytes;
  parts.ledger.drop_empty_names(heard.now);
  // Of control messages that overtook each other the last one counts.
  if (heard.is_last) {
    heard.peer->left = false;
    heard.peer->floor = heard.announcement.floor;
    heard.peer->epoch = is_whole ? epoch : std::nullopt;
    // Where robots sign, what others can be shown counts: statements.
    if (!parts.gate.signatures().on())
      parts.ledger.note_floor(heard.header.sender, heard.announcement.floor, true, parts.counted);
  }
  for (ByteReader body(heard.body); body.remaining() != 0 && read_announced(body, announced);)
    hear_announced(parts, heard, announced);
  if (!parts.gate.signatures().on() && heard.is_last && epoch && is_whole)
    parts.ledger.drop_unlisted(heard.header.sender, *epoch, heard.now, parts.counted);
  return true;
}

void AnnouncementTaker::hear_announced(const ExchangeParts& parts, const Heard& heard,
                                       const AnnouncedContribution& announced) const noexcept {
  if (announced.is_floor() && parts.gate.signatures().on()) {
    if (announced.id.robot == robot_) parts.ledger.note_floor_claim(announced.id.epoch, heard.now);
    return;
  }
  if (!announced.disputed) owe_conflict(parts, heard, announced.id);
  note_agreement(parts, heard, announced);
  if (parts.ledger.is_of_this_process(announced.id)) {
    hear_own(parts, heard, announced);
    return;
  }
  if (parts.is_refused(announced.id, heard, announce_)) return;
  if (FarContribution* const far = parts.ledger.far().find(announced.id); far != nullptr) {
    hear_far(parts, heard, announced, *far);
    return;
  }
  Ledger::Contribution* const contribution =
      parts.ledger.note_name(announced.id, heard.now, parts.counted);
  if (contribution == nullptr) {
    if (parts.ledger.would_displace(announced.id))
      parts.repair.note_displacing(announced.id, *heard.peer, heard.now);
    return;
  }
  if (announced.id.robot == heard.header.sender && heard.is_last)
    hear_robot_itself(parts, heard.now, announced, *contribution);
  AnnouncedContribution believed = announced;
  if (contribution->open && parts.origin_speaks(*contribution, heard, announce_))
    believed.frame_revision = std::min(announced.frame_revision, contribution->frame_revision);
  parts.repair.note_announced(parts.ledger, *contribution, believed, *heard.peer, heard.now,
                              parts.counted);
}

std::uint32_t AnnouncementTaker::peers_agreeing(const PeerTable& peers, std::uint32_t contributions,
                                                Instant now) const noexcept {
  const std::span<const Peer> all = peers.all();
  // What does not fit one announcement comes in turns, a robot's own in every other one.
  constexpr std::int64_t kInOne = 40;
  const std::int64_t turns = contributions / kInOne;
  return static_cast<std::uint32_t>(std::count_if(all.begin(), all.end(), [&](const Peer& peer) {
    return !peer.left && !peer.mismatch && peer.agreed > peer.differed &&
           now - peer.differed > 4 * turns * announce_ &&
           now - peer.agreed <= kSilences * announce_;
  }));
}

/// Whoever announces a contribution without knowing of the proof against it is sent the proof; of a
/// robot that is banned, whoever announces anything is sent all of them.
void AnnouncementTaker::owe_conflict(const ExchangeParts& parts, const Heard& heard,
                                     const ContributionId& id) const noexcept {
  const bool is_accused = id.robot == heard.header.sender;
  const bool is_banned = parts.gate.is_banned(id.robot);
  for (Conflicts::Known& known : parts.ledger.conflicts().all()) {
    if (known.id.robot != id.robot || (known.id.epoch != id.epoch && !is_banned)) continue;
    Conflicts::owe(known, heard.now + answer_ / 4 + parts.repair.random(answer_),
                   is_accused ? kBetweenAccusations : kBetweenProofs);
  }
}

bool AnnouncementTaker::hear_conflict(const ExchangeParts& parts, const Heard& heard) noexcept {
  ConflictBody conflict;
  ByteReader body(heard.body);
  if (!parts.gate.signatures().on() || !read_conflict(body, conflict) || body.remaining() != 0)
    return false;
  if (parts.gate.is_excluded(conflict.id.robot)) return true;
  Conflicts& conflicts = parts.ledger.conflicts();
  if (Conflicts::Known* const known = conflicts.find(conflict.id.robot, conflict.id.epoch);
      known != nullptr) {
    // Who lacks it has it now.
    if (std::ranges::equal(heard.body, std::span(known->body).first(known->bytes)))
      known->due = Instant::never();
    return true;
  }
  if (!conflicts.may_check(heard.now)) {
    ++parts.counted.refused_rate;
  } else if (!parts.ledger.take_conflict(conflict, parts.counted)) {
    ++parts.counted.refused_signature;
  }
  return true;
}

/// What new proofs end.
void AnnouncementTaker::judge_conflicts(const ExchangeParts& parts) noexcept {
  const std::span<Conflicts::Known> all = parts.ledger.conflicts().all();
  if (all.size() == judged_) return;
  parts.ledger.end_disputed(parts.counted);
  if (parts.gate.details().conflicts == ConflictPolicy::kExclude) {
    for (const Conflicts::Known& known : all.subspan(judged_)) {
      const std::uint32_t robot = known.id.robot;
      if (robot == robot_ || parts.ledger.conflicts().count_of(robot) < Conflicts::kMostOfRobot)
        continue;
      parts.gate.ban(robot);
      parts.ledger.remove_robot(robot);
    }
  }
  judged_ = all.size();
}

}  // namespace tessera
