// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Places of contributions and their frames.
#include "tessera/exchange/internal/ledger.hpp"

#include <algorithm>

namespace tessera {

namespace {

/// A name for which neither frame nor statement came gives its place back.
constexpr Duration kNameTime{10'000'000};
/// Without signatures, a robot that was not heard for so long may be one that does not exist.
constexpr Duration kSilentTime{10'000'000};
/// An announcement may have been overtaken by what it does not know of yet.
constexpr Duration kDenialTime{500'000};

}  // namespace

Result<Ledger> Ledger::make(Arena& arena, const ExchangeConfig& config, const ReplicaStore& store,
                            const Gate& gate, int num_components) noexcept {
  Ledger ledger;
  ledger.robot_ = config.robot;
  ledger.session_ = config.session;
  ledger.resolution_m_ = config.resolution_m;
  ledger.per_robot_ = config.contributions_per_robot;
  ledger.own_places_ = config.own_contributions;
  ledger.frame_pause_ = {config.frame_us};
  ledger.store_ = store;
  ledger.signatures_ = gate.signatures();
  ledger.configuration_ = gate.configuration();
  ledger.num_components_ = num_components;
  ledger.policy_ = config.conflicts;
  ledger.contributions_ = arena.take<Contribution>(config.contributions);
  ledger.links_ = arena.take<RecordLink>(config.records);
  ledger.floors_ = arena.take<RobotFloor>(config.peers + 1);
  Result<BlockContent> content = BlockContent::make(arena, num_components);
  ledger.packed_ = arena.take<std::byte>(most_packed_bytes(num_components));
  ledger.coded_ = arena.take<std::byte>(kMostCoded);
  ledger.kept_ = arena.take<std::byte>(kMostKept);
  ledger.tree_ = arena.take<HashTree>(1).data();
  const Result<Conflicts> conflicts = Conflicts::make(arena);
  if (ledger.contributions_.empty() || ledger.links_.empty() || ledger.floors_.empty() ||
      !content.ok() || ledger.packed_.empty() || ledger.coded_.empty() || ledger.kept_.empty() ||
      ledger.tree_ == nullptr || !conflicts.ok())
    return Status::kResourceExhausted;
  ledger.content_ = *content;
  ledger.conflicts_ = *conflicts;
  return ledger;
}

Ledger::Contribution* Ledger::find(const ContributionId& id) noexcept {
  for (Contribution& contribution : contributions_) {
    if (contribution.used && contribution.id == id) return &contribution;
  }
  return nullptr;
}

/// A place that nobody has, but for those that are kept for this robot's own.
Ledger::Contribution* Ledger::free_place(bool own) noexcept {
  std::uint32_t kept = own ? 0 : own_places_ - std::min(opened_, own_places_);
  for (Contribution& place : contributions_) {
    if (place.used) continue;
    if (kept == 0) return &place;
    --kept;
  }
  return nullptr;
}

/// Where a robot has all of its places, the one that gives way: a name, or the lowest. Null where
/// it has fewer; refused where none gives way.
Ledger::Contribution* Ledger::displaced_of_robot(const ContributionId& id, bool proven,
                                                 bool& refused) noexcept {
  std::uint32_t count = 0;
  Contribution* lowest = nullptr;
  for (Contribution& other : contributions_) {
    if (!other.used || other.own || other.id.robot != id.robot) continue;
    ++count;
    const bool lower =
        lowest == nullptr || (other.open == lowest->open ? other.id < lowest->id : !other.open);
    if (lower) lowest = &other;
  }
  if (lowest == nullptr || count < per_robot_) return nullptr;
  refused = !proven || (lowest->open && id < lowest->id);
  return lowest;
}

/// Where nobody signs, one can fill all places with robots that do not exist: of those that are not
/// heard, the one with the fewest records.
Ledger::Contribution* Ledger::place_of_silent(Instant now) noexcept {
  Contribution* least = nullptr;
  for (Contribution& other : contributions_) {
    if (!other.used || other.own || now - other.origin_at <= kSilentTime) continue;
    if (least == nullptr || other.records < least->records) least = &other;
  }
  return least;
}

Ledger::Contribution* Ledger::add(const ContributionId& id, Claim claim, Instant now,
                                  ExchangeReport& counted) noexcept {
  const bool own = claim == Claim::kOwn;
  const bool proven = claim != Claim::kName;
  bool refused = false;
  Contribution* const of_robot = own ? nullptr : displaced_of_robot(id, proven, refused);
  if (refused) {
    ++counted.refused_contributions;
    return nullptr;
  }
  Contribution* place = of_robot != nullptr ? of_robot : free_place(own);
  if (place == nullptr && proven) {
    // A name gives its place to what is there.
    for (Contribution& other : contributions_) {
      if (other.used && !other.open) place = &other;
    }
  }
  if (place == nullptr && claim == Claim::kPresent) place = place_of_silent(now);
  if (place == nullptr) {
    ++counted.refused_contributions;
    return nullptr;
  }
  if (place->used) ++counted.displaced_contributions;
  drop(*place);
  place->used = true;
  place->id = id;
  place->since = now;
  return place;
}

/// Empties a place. Its index is large: it is cleared where it is.
void Ledger::drop(Contribution& contribution) noexcept {
  if (contribution.used && contribution.open) store_.remove(store_.context, contribution.slot);
  contribution.used = contribution.own = contribution.open = false;
  contribution.stated = contribution.full = false;
  contribution.proof_bytes = 0;
  ++contribution.generation;
  contribution.latest = contribution.announced_frame = contribution.frame_revision = 0;
  held_bytes_ -= contribution.record_bytes;
  contribution.record_bytes = 0;
  contribution.records = 0;
  contribution.held = {};
  contribution.statement = {};
  contribution.frame_at = contribution.since = contribution.origin_at = Instant::long_ago();
  contribution.listed = contribution.denied = Instant::long_ago();
  contribution.coverage.clear();
  contribution.index.clear();
}

Ledger::Contribution* Ledger::note_name(const ContributionId& id, Instant now,
                                        ExchangeReport& counted) noexcept {
  if (Contribution* const known = find(id); known != nullptr) return known;
  if (id.epoch < floor_of(id.robot)) {
    ++counted.refused_epochs;
    return nullptr;
  }
  if (is_ended(id)) {
    ++counted.refused_disputed;
    return nullptr;
  }
  return add(id, Claim::kName, now, counted);
}

void Ledger::drop_unlisted(std::uint32_t robot, std::uint32_t epoch, Instant now,
                           ExchangeReport& counted) noexcept {
  for (Contribution& contribution : contributions_) {
    if (!contribution.used || contribution.own || contribution.id.robot != robot ||
        contribution.id.epoch < epoch)
      continue;
    if (contribution.listed == now) {
      contribution.denied = Instant::long_ago();
    } else if (contribution.denied == Instant::long_ago()) {
      contribution.denied = now;
    } else if (now - contribution.denied >= kDenialTime) {
      drop(contribution);
      ++counted.ended_contributions;
    }
  }
}

void Ledger::drop_empty_names(Instant now) noexcept {
  for (Contribution& contribution : contributions_) {
    if (contribution.used && !contribution.open && !contribution.full &&
        now - contribution.since > kNameTime)
      drop(contribution);
  }
}

void Ledger::remove_robot(std::uint32_t robot) noexcept {
  for (Contribution& contribution : contributions_) {
    if (contribution.used && contribution.id.robot == robot) drop(contribution);
  }
}

Statement Ledger::statement_of(const Contribution& own, VersionRange range) const noexcept {
  return {.id = own.id,
          .range = range,
          .latest = own.latest,
          .records = own.records,
          .fingerprint = own.held,
          .frame_revision = own.frame_revision,
          .floor = own_floor_,
          .session = session_};
}

Status Ledger::set_frame(Contribution& contribution, const Matrix34d& T_global_map,
                         std::uint32_t revision) const noexcept {
  const Result<GridTransform> frame = GridTransform::make(T_global_map, resolution_m_);
  if (!frame.ok()) return Status::kInvalidArgument;
  if (!contribution.open) {
    const Result<Slot> slot = store_.open(store_.context, contribution.id, *frame);
    if (!slot.ok()) return slot.status();
    contribution.slot = *slot;
    contribution.open = true;
  }
  store_.set_frame(store_.context, contribution.slot, *frame, revision);
  contribution.T_global_map = T_global_map;
  contribution.frame_revision = revision;
  contribution.announced_frame = std::max(contribution.announced_frame, revision);
  return Status::kOk;
}

/// At most one revision a frame_pause_: each moves all of the contribution in the global map.
bool Ledger::take_frame(const FrameBody& frame, std::span<const std::byte> signature, bool is_last,
                        Instant now, ExchangeReport& counted) noexcept {
  Contribution* known = find(frame.id);
  if (frame.id.epoch < floor_of(frame.id.robot)) {
    ++counted.refused_epochs;
    return true;
  }
  if (known == nullptr && is_ended(frame.id)) {
    ++counted.refused_disputed;
    return true;
  }
  const bool replaces =
      !signatures_.on() && is_last && known != nullptr && known->open &&
      (frame.revision != known->frame_revision || frame.T_global_map != known->T_global_map);
  const bool is_old = known != nullptr && !replaces && frame.revision <= known->frame_revision;
  if (is_old || (known != nullptr && known->own)) return true;
  if (known != nullptr && known->open && now - known->frame_at < frame_pause_) {
    ++counted.frames_early;
    known->announced_frame = std::max(known->announced_frame, known->frame_revision + 1);
    return true;
  }
  if (!GridTransform::make(frame.T_global_map, resolution_m_).ok()) return false;
  if (signatures_.on() &&
      !signatures_.check(signatures_.context, frame.id.robot, frame_message(configuration_, frame),
                         signature.first<kSignatureBytes>())) {
    ++counted.refused_signature;
    return true;
  }
  const bool present = !signatures_.on() && is_last;
  if (known == nullptr)
    known = add(frame.id, present ? Claim::kPresent : Claim::kFrame, now, counted);
  if (known == nullptr) return true;
  // Without a slot it is asked for as what finds no room is.
  known->full = set_frame(*known, frame.T_global_map, frame.revision) != Status::kOk;
  if (known->full) {
    ++counted.refused_contributions;
    return true;
  }
  known->frame_at = now;
  std::copy(signature.begin(), signature.end(), known->frame_signature.begin());
  return true;
}

std::uint64_t Ledger::digest() const noexcept {
  // A sum: contributions came in any order.
  std::uint64_t sum = 0;
  for (const Contribution& contribution : contributions_) {
    if (!contribution.used || !contribution.open) continue;
    Digest of;
    of.add(contribution.id.robot);
    of.add(std::uint64_t{contribution.id.epoch} << 32U | contribution.id.submap);
    of.add(contribution.frame_revision);
    of.add(contribution.held.low);
    of.add(contribution.held.high);
    sum += of.value();
  }
  return sum;
}

}  // namespace tessera
