// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/repair.hpp"

#include <algorithm>

namespace tessera {

namespace {

/// Announcements for which one who was heard to hold something else is expected to be there still:
/// of a hundred, one may arrive.
constexpr std::int64_t kAwaited = 300;
/// Requests for what a robot claims that there is.
constexpr std::uint32_t kRequestsForClaim = 2;
/// Between two requests for what is stated in this robot's name, or displaces by its name.
constexpr Duration kClaimTime{1'000'000};
/// Pauses for which others who ask for the same put a request off, at most: one of them may ask all
/// the while, and get what this robot has.
constexpr std::int64_t kPutOff = 3;
/// What came may still be on its way to the robot that announced without it.
constexpr Duration kSettleTime{100'000};
/// More may come all the while: a comparison begins nevertheless after this.
constexpr Duration kMostSettleTime{2'000'000};
/// A robot by whose comparison nothing came waits for as long as that took, at most so long.
constexpr Duration kMostPeerPause{60'000'000};
/// One that brought some and no end: it may be slow on purpose.
constexpr Duration kProductivePause{15'000'000};

}  // namespace

Result<Repair> Repair::make(Arena& arena, const ExchangeConfig& config) noexcept {
  Repair repair;
  repair.request_ = {config.request_us};
  repair.request_most_ = {config.request_most_us};
  repair.request_idle_ = {config.request_idle_us};
  repair.announce_ = {config.announce_us};
  repair.random_ = mix64((std::uint64_t{config.robot} << 32U) + mix64(config.session));
  repair.needs_ = arena.take<Need>(config.contributions);
  repair.claims_ = arena.take<Claim>(2 * kMostClaims);
  repair.gaps_ = arena.take<VersionRange>(kMostGapsAsked);
  const std::span<RequestedContribution> requested = arena.take<RequestedContribution>(1);
  repair.requested_ = requested.data();
  Result<Comparison> comparison = Comparison::make(arena);
  if (repair.needs_.empty() || repair.claims_.empty() || repair.gaps_.empty() ||
      requested.empty() || !comparison.ok())
    return Status::kResourceExhausted;
  repair.comparison_ = *comparison;
  return repair;
}

Duration Repair::random(Duration below) noexcept {
  if (below.us <= 0) return {};
  random_ += 0x9e3779b97f4a7c15U;
  return {static_cast<std::int64_t>(mix64(random_) % static_cast<std::uint64_t>(below.us))};
}

Repair::Need& Repair::need_of(const Ledger& ledger,
                              const Ledger::Contribution& contribution) noexcept {
  Need& need = needs_[ledger.number_of(contribution)];
  if (need.generation != contribution.generation) {
    need = {};
    need.generation = contribution.generation;
  }
  return need;
}

/// Anybody may say a name: by each place one of them is asked for in kClaimTime. Who says many
/// takes no place but its own.
void Repair::note(std::span<Claim> claims, const Peer& peer, const Claim& noted) noexcept {
  Claim& place = claims[peer.robot % claims.size()];
  if (noted.noted - place.noted >= kClaimTime) place = noted;
}

void Repair::note_announced(Ledger& ledger, Ledger::Contribution& contribution,
                            const AnnouncedContribution& announced, const Peer& peer, Instant now,
                            ExchangeReport& counted) noexcept {
  if (contribution.own) return;
  Need& need = need_of(ledger, contribution);
  const bool is_idle = contribution.far && contribution.stated && now - need.asked < kFarPause;
  const bool newer = announced.stated && !is_idle &&
                     (!contribution.stated || announced.latest > contribution.statement.latest);
  if (announced.complete && announced.latest >= contribution.statement.latest)
    contribution.elsewhere = now;
  if (newer) need.announced = std::max(need.announced, announced.latest);
  // Nobody has signed that there is more: once it was asked for, the next one who knows of no more
  // ends it, and not before, as that one may be behind.
  const bool was_asked = need.requests >= kRequestsForClaim || need.due == Instant::never();
  const bool is_same = announced.stated && announced.latest == contribution.statement.latest;
  if (!newer && is_same && was_asked) need.announced = 0;
  if (announced.frame_revision > contribution.sure_frame()) {
    contribution.announced_frame = contribution.sure_frame() + 1;
  } else if (was_asked) {
    contribution.announced_frame = contribution.frame_revision;
  }
  note_lack(ledger, contribution, now);
  if (contribution.far) return;
  if (contribution.open && contribution.held.folded() == announced.digest) {
    need.unsettled = Instant::never();
    return;
  }
  need.different = now;
  // Somebody is there who may have what is asked for.
  if (need.due != Instant::never() && !contribution.full) {
    need.pause = std::min(need.pause, request_most_);
    need.due = std::min(need.due, now + 2 * request_most_);
  }
  consider_comparison(ledger, contribution, need, announced, peer, now, counted);
}

/// Both know of the same versions and hold different records, or nobody is left who knows the
/// statement: what was relayed before it came is compared all the same. Who holds what its origin
/// states leaves the asking to the other, unless that one does so too: then there are two
/// statements of one moment.
void Repair::consider_comparison(Ledger& ledger, const Ledger::Contribution& contribution,
                                 Need& need, const AnnouncedContribution& announced,
                                 const Peer& peer, Instant now, ExchangeReport& counted) noexcept {
  if (comparison_.active() || !contribution.open || announced.stated != contribution.stated ||
      announced.latest != contribution.statement.latest ||
      (contribution.complete() && !announced.complete) || now < peer.compare_due)
    return;
  const bool settled = !lacks_versions(contribution) || (need.requests > 2 && !contribution.full);
  if (!settled || now < need.compare_due) return;
  if (now - need.taken < kSettleTime) {
    const bool is_old =
        need.unsettled != Instant::never() && now - need.unsettled > 2 * kMostSettleTime;
    need.unsettled = is_old ? now : std::min(need.unsettled, now);
    if (now - need.unsettled < kMostSettleTime) return;
  }
  need.unsettled = Instant::never();
  ++counted.diverged;
  // Where nothing is stated, the other one may have any version.
  const std::uint32_t latest = contribution.stated ? contribution.latest : kLastVersion;
  comparison_.begin(ledger, contribution, peer.robot, latest, now);
}

void Repair::end_comparison(Ledger& ledger, PeerTable& peers, Instant now) noexcept {
  if (!comparison_.active()) return;
  const Ledger::Contribution& contribution = ledger.place(comparison_.number());
  const bool there = comparison_.is_of(comparison_.number(), contribution.generation);
  if (there && !comparison_.is_over(ledger, contribution, now)) return;
  comparison_.end();
  if (!there) return;
  // One at a time: others get their turn before who brought nothing, or no end, has the next.
  const Duration lasted = now - comparison_.began();
  const Duration pause = std::min(std::max(lasted, 2 * announce_), kMostPeerPause);
  if (Peer* const peer = peers.find(comparison_.robot());
      peer != nullptr && (!comparison_.took() || lasted > Comparison::kLongest))
    peer->compare_due = now + (comparison_.took() ? std::min(pause, kProductivePause) : pause);
  Need& need = need_of(ledger, contribution);
  // What was found is on its way, or was lost like what was not answered; where nothing was found
  // or there is no room for it, the next one is later and later.
  const bool soon = (comparison_.found() || comparison_.gave_up()) && !contribution.full;
  need.compare_pause =
      std::clamp(2 * need.compare_pause, request_, soon ? request_most_ : request_idle_);
  need.compare_due = now + need.compare_pause;
}

void Repair::note_taken(Ledger& ledger, Ledger::Contribution& contribution,
                        const Ledger::Taken& taken, bool fills, std::uint32_t sender,
                        Instant now) noexcept {
  Need& need = need_of(ledger, contribution);
  // That a block which is held was replaced says nothing about room for others.
  if (taken.refused || (fills && taken.grew)) contribution.full = taken.refused;
  if (taken.records != 0) {
    need.taken = now;
    if (fills) need.filled = now;
    if (fills && comparison_.is_of(ledger.number_of(contribution), contribution.generation))
      comparison_.note_taken(sender, now);
    if (!taken.refused) need.compare_pause = {};
  }
  // While gaps are filled, others may be too: not for long, as what is filled may be what somebody
  // else asked for. New versions tell nothing about them.
  if (fills && taken.grew && !taken.refused && need.due != Instant::never()) {
    need.requests = 0;
    need.pause = request_;
    need.due =
        std::min(now + request_ + random(request_), std::max(now, need.asked + 2 * request_));
  }
  note_lack(ledger, contribution, now);
}

void Repair::note_lack(Ledger& ledger, Ledger::Contribution& contribution, Instant now) noexcept {
  Need& need = need_of(ledger, contribution);
  if (contribution.complete() && !contribution.own) {
    contribution.coverage.add({1, contribution.statement.latest});
    contribution.full = false;
    contribution.whole = true;
  }
  if (contribution.stated && need.announced <= contribution.statement.latest) need.announced = 0;
  if (contribution.own || !(lacks_versions(contribution) || need.announced != 0)) {
    need.due = Instant::never();
    return;
  }
  if (need.due != Instant::never()) return;
  need.asked = now;
  need.requests = 0;
  need.pause = request_;
  need.due = now + request_ + random(request_);
}

void Repair::note_asked(const Ledger& ledger, const Ledger::Contribution& contribution, Instant now,
                        ExchangeReport& counted) noexcept {
  Need& need = need_of(ledger, contribution);
  if (need.due == Instant::never()) return;
  ++counted.requests_saved;
  const Instant latest = need.asked + kPutOff * need.pause;
  need.due = std::max(need.due, std::min(now + need.pause + random(need.pause), latest));
}

/// Each is asked for less and less often while nothing comes.
void Repair::put_off(const Ledger::Contribution& contribution, Need& need, Instant now) noexcept {
  need.asked = now;
  const bool awaited = now - need.different <= kAwaited * announce_;
  const bool soon = ++need.requests <= kPatience || awaited;
  // One that answers is there: what was asked for was lost.
  const bool answered = !contribution.full && now - need.filled < request_most_;
  need.pause = answered ? request_
                        : std::min(2 * need.pause,
                                   soon && !contribution.full ? request_most_ : request_idle_);
  need.due = now + need.pause + random(need.pause);
}

void Repair::begin_request(const Ledger::Contribution& contribution) noexcept {
  requested_->type = RequestType::kGaps;
  requested_->id = contribution.id;
  requested_->frame_revision = contribution.sure_frame();
  requested_->stated = contribution.stated;
  requested_->latest = contribution.statement.latest;
  requested_->count = 0;
}

bool Repair::write_comparison(Ledger& ledger, ByteWriter& to) noexcept {
  if (!comparison_.active()) return false;
  const Ledger::Contribution& contribution = ledger.place(comparison_.number());
  if (!comparison_.is_of(comparison_.number(), contribution.generation)) {
    comparison_.end();
    return false;
  }
  begin_request(contribution);
  return comparison_.write_next(*requested_) && write_requested(to, *requested_);
}

/// While something comes, what comes next needs no asking: the last gap is left out if there are
/// others. What does not fit this datagram is in the next one.
bool Repair::write_gaps(const Ledger::Contribution& contribution, Need& need, ByteWriter& to,
                        Instant now) noexcept {
  std::size_t count = 0;
  if (contribution.open && contribution.stated && !contribution.far)
    count = contribution.coverage.gaps(contribution.statement.latest, gaps_);
  const bool comes = count > 1 && now - need.taken < request_;
  if (comes && gaps_[count - 1].last == contribution.statement.latest) --count;
  std::size_t first = 0;
  while (first < count && gaps_[first].last <= need.asked_to) ++first;
  bool any = false;
  need.asked_to = 0;
  while (!any || first < count) {
    begin_request(contribution);
    const std::size_t here = std::min(count - first, RequestedContribution::kMostGaps);
    std::copy_n(gaps_.begin() + static_cast<std::ptrdiff_t>(first), here, requested_->gap.begin());
    requested_->count = static_cast<std::uint8_t>(here);
    if (!write_requested(to, *requested_)) {
      if (any && first != 0) need.asked_to = gaps_[first - 1].last;
      break;
    }
    first += here;
    any = true;
  }
  return any;
}

bool Repair::write(Ledger& ledger, ByteWriter& to, Instant now, ExchangeReport& counted) noexcept {
  bool any = write_comparison(ledger, to);
  for (Claim& claim : claims_) {
    if (!claim.wanted) continue;
    requested_->type = RequestType::kGaps;
    requested_->id = claim.id;
    requested_->frame_revision = claim.frame_revision;
    requested_->stated = claim.stated;
    requested_->latest = claim.latest;
    requested_->count = 0;
    if (!write_requested(to, *requested_)) break;
    claim.wanted = false;
    any = true;
  }
  for (Ledger::Contribution& contribution : ledger.places()) {
    if (!contribution.used || contribution.own) continue;
    Need& need = need_of(ledger, contribution);
    if (now < need.due) continue;
    if (!write_gaps(contribution, need, to, now)) break;
    any = true;
    if (need.asked_to != 0) continue;
    put_off(contribution, need, now);
    note_lack(ledger, contribution, now);
  }
  counted.requests += any ? 1U : 0U;
  return any;
}

}  // namespace tessera
