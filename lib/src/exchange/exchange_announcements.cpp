// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What robots announce that they hold, and proofs of conflicts, which go to those who announce
// without knowing of them.
#include <algorithm>

#include "tessera/exchange/exchange.hpp"

namespace tessera {

namespace {

/// Between two times that a proof is sent because somebody lacks it; the accused robot itself may
/// only pretend to.
constexpr Duration kBetweenProofs{500'000};
constexpr Duration kBetweenAccusations{8'000'000};

}  // namespace

bool Exchange::hear_announcement(const Heard& heard) noexcept {
  AnnouncedContribution announced;
  ByteReader all(heard.body);
  std::optional<std::uint32_t> epoch;
  bool all_own = true;  // there is nothing of others, so the list may be cut short
  while (all.remaining() != 0) {
    if (!read_announced(all, announced)) return false;
    const bool own = announced.id.robot == heard.header.sender;
    if (own && announced.origin) epoch = std::max(epoch.value_or(0), announced.id.epoch);
    all_own = all_own && own;
  }
  const bool is_whole = !all_own || heard.body.size() + AnnouncementHeader::kMostBytes +
                                            AnnouncedContribution::kBytes + kSignatureBytes <
                                        kMostBodyBytes;
  ledger_.drop_empty_names(heard.now);
  // Of control messages that overtook each other the last one counts.
  if (heard.is_last) {
    heard.peer->left = false;
    heard.peer->floor = heard.announcement.floor;
    ledger_.note_floor(heard.header.sender, heard.announcement.floor, !gate_.signatures().on(),
                       counted_);
  }
  for (ByteReader body(heard.body); body.remaining() != 0 && read_announced(body, announced);)
    hear_announced(heard, announced);
  if (!gate_.signatures().on() && heard.is_last && epoch && is_whole)
    ledger_.drop_unlisted(heard.header.sender, *epoch, heard.now, counted_);
  return true;
}

void Exchange::hear_announced(const Heard& heard, const AnnouncedContribution& announced) noexcept {
  if (announced.is_floor() && gate_.signatures().on()) {
    if (announced.id.robot == robot_) ledger_.note_floor_claim(announced.id.epoch);
    return;
  }
  if (!announced.disputed) owe_conflict(heard, announced.id);
  note_agreement(heard, announced);
  if (ledger_.is_of_this_process(announced.id)) {
    const Ledger::Contribution* const own = ledger_.find(announced.id);
    const bool more = own == nullptr || announced.latest > own->latest;
    const bool other = own != nullptr && announced.complete && announced.latest == own->latest &&
                       announced.digest != own->held.folded();
    // It is a claim only: what was stated shows whether it is true.
    counted_.impostors += more && !gate_.signatures().on() ? 1U : 0U;
    if ((more || other) && announced.stated) repair_.note_claim(announced.id, heard.now);
    return;
  }
  if (gate_.is_excluded(announced.id.robot)) return;
  Ledger::Contribution* const contribution = ledger_.note_name(announced.id, heard.now, counted_);
  if (contribution == nullptr) return;
  if (announced.origin && announced.id.robot == heard.header.sender && heard.is_last)
    contribution->origin_at = heard.now;
  if (announced.id.robot == heard.header.sender && heard.is_last) contribution->listed = heard.now;
  repair_.note_announced(ledger_, *contribution, announced, *heard.peer, heard.now, counted_);
}

/// Whether a robot holds the same as this one shows in what it announces, a part at a time.
void Exchange::note_agreement(const Heard& heard, const AnnouncedContribution& announced) noexcept {
  const Ledger::Contribution* const known = ledger_.find(announced.id);
  const bool same = known != nullptr && known->open && known->complete() && announced.complete &&
                    announced.digest == known->held.folded();
  if (!same) heard.peer->differed = heard.now;
  const Ledger::Contribution* const publishing = ledger_.publishing();
  if (same && (known == publishing || publishing == nullptr)) heard.peer->agreed = heard.now;
}

std::uint32_t Exchange::peers_agreeing(std::int64_t now_us) const noexcept {
  const Instant now = Instant::at_us(now_us);
  const std::span<const Peer> all = gate_.peers().all();
  // What does not fit one announcement comes in turns.
  constexpr std::int64_t kInOne = 40;
  const std::int64_t turns = report().contributions / kInOne;
  return static_cast<std::uint32_t>(std::count_if(all.begin(), all.end(), [&](const Peer& peer) {
    return !peer.left && !peer.mismatch && peer.agreed > peer.differed &&
           now - peer.differed > 2 * turns * announce_ &&
           now - peer.agreed <= kSilences * announce_;
  }));
}

/// Whoever announces a contribution without knowing of the proof against it is sent the proof; of a
/// robot that is banned, whoever announces anything is sent all of them.
void Exchange::owe_conflict(const Heard& heard, const ContributionId& id) noexcept {
  const bool is_accused = id.robot == heard.header.sender;
  const bool is_banned = gate_.is_banned(id.robot);
  for (Conflicts::Known& known : ledger_.conflicts().all()) {
    if (known.id.robot != id.robot || (known.id.epoch != id.epoch && !is_banned)) continue;
    Conflicts::owe(known, heard.now + answer_ / 4 + repair_.random(answer_),
                   is_accused ? kBetweenAccusations : kBetweenProofs);
  }
}

bool Exchange::hear_conflict(const Heard& heard) noexcept {
  ConflictBody conflict;
  ByteReader body(heard.body);
  if (!gate_.signatures().on() || !read_conflict(body, conflict) || body.remaining() != 0)
    return false;
  if (gate_.is_excluded(conflict.id.robot)) return true;
  Conflicts& conflicts = ledger_.conflicts();
  if (Conflicts::Known* const known = conflicts.find(conflict.id.robot, conflict.id.epoch);
      known != nullptr) {
    // Who lacks it has it now.
    if (std::ranges::equal(heard.body, std::span(known->body).first(known->bytes)))
      known->due = Instant::never();
    return true;
  }
  if (!conflicts.may_check(heard.now)) {
    ++counted_.refused_rate;
  } else if (!ledger_.take_conflict(conflict, counted_)) {
    ++counted_.refused_signature;
  }
  return true;
}

/// What new proofs end.
void Exchange::judge_conflicts() noexcept {
  const std::span<Conflicts::Known> all = ledger_.conflicts().all();
  if (all.size() == judged_) return;
  ledger_.end_disputed(counted_);
  if (gate_.details().conflicts == ConflictPolicy::kExclude) {
    for (const Conflicts::Known& known : all.subspan(judged_)) {
      const std::uint32_t robot = known.id.robot;
      if (robot == robot_ || ledger_.conflicts().count_of(robot) < Conflicts::kMostOfRobot)
        continue;
      gate_.ban(robot);
      ledger_.remove_robot(robot);
    }
  }
  judged_ = all.size();
}

}  // namespace tessera
