// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/contribution_table.hpp"

#include <algorithm>

#include "tessera/base/internal/digest.hpp"

namespace tessera {

namespace {

/// A name for which neither frame nor statement came gives its place back.
constexpr Duration kNameTime{10'000'000};
/// An announcement may have been overtaken by what it does not know of yet.
constexpr Duration kDenialTime{500'000};

}  // namespace

Result<ContributionTable> ContributionTable::make(Arena& arena, const ExchangeConfig& config,
                                                  const ReplicaStore& store) noexcept {
  ContributionTable table;
  table.store_ = store;
  table.resolution_m_ = config.resolution_m;
  table.per_robot_ = config.contributions_per_robot;
  table.own_places_ = config.own_contributions;
  table.places_ = arena.take<HeldContribution>(config.contributions);
  table.names_ = arena.take<Name>(config.contributions);
  table.of_robot_ = arena.take<std::uint32_t>(config.contributions);
  const Result<PartPool<VersionBuckets>*> buckets =
      PartPool<VersionBuckets>::make(arena, VersionIndex::kParts * large(config));
  const Result<PartPool<Coverage::Part>*> ranges =
      PartPool<Coverage::Part>::make(arena, large(config));
  if (!buckets.ok() || !ranges.ok()) return Status::kResourceExhausted;
  for (HeldContribution& place : table.places_) {
    place.index.use(**buckets);
    place.coverage.use(**ranges);
  }
  Result<FarContributions> far =
      FarContributions::make(arena, config.far_contributions, config.session);
  const Result<PlacesOfRobots> of_robots = PlacesOfRobots::make(arena, config.contributions);
  if (table.places_.empty() || table.names_.empty() || table.of_robot_.empty() || !far.ok() ||
      !of_robots.ok())
    return Status::kResourceExhausted;
  table.far_ = *far;
  table.of_robots_ = *of_robots;
  return table;
}

HeldContribution* ContributionTable::find(const ContributionId& id) noexcept {
  for (std::size_t i = 0; i < top_; ++i) {
    if (names_[i].used && names_[i].id == id) return &places_[i];
  }
  return nullptr;
}

/// What this robot objected to, or stated about frames, in earlier epochs is as what it has heard:
/// nothing is said of it any more.
void ContributionTable::disown_earlier(const ContributionId& id) noexcept {
  for (HeldContribution& other : places())
    if (other.id.robot == id.robot && kind_of(other.id) == kind_of(id)) other.own = false;
}

/// A name gives its place to what is there: the last one that no more is known of, or nullptr.
HeldContribution* ContributionTable::place_of_name() noexcept {
  HeldContribution* place = nullptr;
  for (HeldContribution& other : places()) {
    if (other.used && !other.open) place = &other;
  }
  return place;
}

HeldContribution* ContributionTable::add(const ContributionId& id, Claim claim, Instant now,
                                         ExchangeReport& counted) noexcept {
  const bool own = claim == Claim::kOwn;
  const bool proven = claim != Claim::kName;
  bool refused = false;
  const bool is_bounded = !own || !has_blocks(id);
  if (own && is_bounded) disown_earlier(id);
  HeldContribution* const of_robot = is_bounded ? displaced_of_robot(id, proven, refused) : nullptr;
  if (refused) {
    ++counted.refused_contributions;
    return nullptr;
  }
  HeldContribution* place = of_robot != nullptr ? of_robot : free_place(own && has_blocks(id));
  if (place == nullptr && proven) place = place_of_name();
  if (place == nullptr && claim == Claim::kPresent) place = place_of_silent(now);
  if (place == nullptr) {
    ++counted.refused_contributions;
    return nullptr;
  }
  if (place->used) ++counted.displaced_contributions;
  if (!place->used || !put_far(*place, counted)) drop(*place);
  take_place(*place, id, now);
  place->far = place->far && !own;
  return place;
}

void ContributionTable::take_place(HeldContribution& place, const ContributionId& id,
                                   Instant now) noexcept {
  of_robots_.add(id);
  used_ += place.used ? 0U : 1U;
  place.used = true;
  place.wanted_at = Instant::long_ago();
  place.away_m = 0.0;
  place.far = !far_.places().empty();  // until it is known where it is
  place.id = id;
  place.since = now;
  names_[number_of(place)] = {id, true};
  top_ = std::max<std::size_t>(top_, number_of(place) + 1);
}

/// Empties a place. Its index is large: it is cleared where it is.
void ContributionTable::drop(HeldContribution& contribution) noexcept {
  if (contribution.used && contribution.open) store_.remove(store_.context, contribution.slot);
  if (is_counted(contribution)) of_robots_.remove(contribution.id);
  if (publishing() == &contribution) publishing_ = kNobody;
  names_[number_of(contribution)].used = false;
  while (top_ != 0 && !names_[top_ - 1].used) --top_;
  used_ -= contribution.used ? 1U : 0U;
  contribution.used = contribution.own = contribution.open = contribution.moved = false;
  contribution.stated = contribution.full = contribution.frame_doubted = false;
  contribution.far = contribution.whole = false;
  contribution.signed_extent = {};
  contribution.proof.keep({});
  contribution.frame_proof.keep({});
  ++contribution.generation;
  contribution.latest = contribution.announced_frame = contribution.frame_revision = 0;
  held_bytes_ -= contribution.record_bytes;
  contribution.record_bytes = 0;
  contribution.records = 0;
  contribution.held = {};
  contribution.statement = {};
  contribution.session = {};
  contribution.frame_at = contribution.since = contribution.origin_at = Instant::long_ago();
  contribution.listed = contribution.denied = contribution.elsewhere = Instant::long_ago();
  contribution.coverage.clear();
  contribution.index.clear();
}

std::uint32_t ContributionTable::drop_unlisted(std::uint32_t robot, std::uint32_t epoch,
                                               Instant now) noexcept {
  const auto is_denied = [&](auto& contribution, const ContributionId& id) {
    if (id.robot != robot || id.epoch < epoch) return false;
    if (contribution.listed == now) {
      contribution.denied = Instant::long_ago();
    } else if (contribution.denied == Instant::long_ago()) {
      contribution.denied = now;
    } else {
      return now - contribution.denied >= kDenialTime;
    }
    return false;
  };
  return drop_if([&](HeldContribution& one) { return !one.own && is_denied(one, one.id); }) +
         far_.remove_if([&](FarContribution& one) { return is_denied(one, one.id()); });
}

void ContributionTable::drop_empty_names(Instant now) noexcept {
  drop_if([&](const HeldContribution& contribution) {
    return !contribution.open && !contribution.full && now - contribution.since > kNameTime;
  });
}

bool ContributionTable::has_any_of(std::uint32_t robot) const noexcept {
  const std::span<const FarContribution> far = far_.places();
  const std::span<const HeldContribution> held = places();
  return std::any_of(held.begin(), held.end(),
                     [&](const HeldContribution& contribution) {
                       return contribution.used && contribution.id.robot == robot;
                     }) ||
         std::any_of(far.begin(), far.end(), [&](const FarContribution& one) {
           return one.used && one.id().robot == robot;
         });
}

Status ContributionTable::set_frame(HeldContribution& contribution, const Matrix34d& T_global_map,
                                    std::uint32_t revision,
                                    const MapSession& session) const noexcept {
  const Result<GridTransform> frame = GridTransform::make(T_global_map, resolution_m_);
  if (!frame.ok()) return Status::kInvalidArgument;
  if (!contribution.open) {
    const Result<Replicas::Slot> slot = store_.open(store_.context, contribution.id, *frame);
    if (!slot.ok()) return slot.status();
    contribution.slot = *slot;
    contribution.open = true;
  }
  store_.set_frame(store_.context, contribution.slot, *frame, revision, session);
  contribution.T_global_map = T_global_map;
  contribution.session = session;
  contribution.frame_revision = revision;
  contribution.frame_doubted = false;
  contribution.announced_frame = std::max(contribution.announced_frame, revision);
  return Status::kOk;
}

namespace {

template <class Contribution>
std::uint64_t digest_of(const ContributionId& id, const Contribution& one,
                        const Fingerprint& content) noexcept {
  Digest of;
  of.add(id.robot);
  of.add(std::uint64_t{id.epoch} << 32U | id.submap);
  of.add(one.frame_revision);
  for (const double element : one.T_global_map.reshaped())
    of.add(std::bit_cast<std::uint64_t>(element));
  if (MapSession::is(id.submap)) {
    of.add(one.session.digest);
    of.add(static_cast<std::uint64_t>(one.session.date_s));
    of.add(one.session.weight);
  }
  of.add(content.low);
  of.add(content.high);
  return of.value();
}

}  // namespace

std::uint64_t ContributionTable::digest() const noexcept {
  // A sum: contributions came in any order. Of one that is far its origin's word counts.
  std::uint64_t sum = 0;
  for (const HeldContribution& one : places()) {
    if (!one.used || !one.open) continue;
    sum += digest_of(one.id, one, one.said());
  }
  for (const FarContribution& one : far_.places()) {
    if (one.used) sum += digest_of(one.id(), one, one.statement.fingerprint);
  }
  return sum;
}

}  // namespace tessera
