// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Making it, what this robot says, and how things stand.
#include "tessera/exchange/exchange.hpp"

#include <algorithm>

#include "tessera/fusion/global_map.hpp"

namespace tessera {

namespace {

/// A record that takes more is published in parts, of which any fits.
static_assert(most_coded_bytes(1) <= kMostCodedBytes);

bool valid(const ExchangeConfig& config) noexcept {
  return config.contributions > config.own_contributions && config.own_contributions >= 1 &&
         config.contributions <= Replicas::kMostContributions && config.peers >= 1 &&
         config.answers >= 1 && config.fresh >= 1 && config.burst_bytes >= kMostDatagramBytes &&
         config.announce_us > 0 && config.announce_soon_us > 0 && config.request_us > 0 &&
         config.request_most_us >= config.request_us &&
         config.request_idle_us >= config.request_most_us && config.bytes_per_s > 0 &&
         config.answer_us > 0;
}

}  // namespace

Result<Exchange> Exchange::make(Arena& arena, const ExchangeConfig& config,
                                const ReplicaStore& store, const Authenticator& authenticator,
                                const ClassTable& classes, const Signatures& signatures) noexcept {
  if (!valid(config)) return Status::kInvalidArgument;
  Exchange exchange;
  exchange.config_ = config;
  exchange.store_ = store;
  exchange.authenticator_ = authenticator;
  exchange.signatures_ = signatures;
  exchange.num_components_ = classes.num_components();
  exchange.details_ = {.resolution_m = config.resolution_m,
                       .prior = config.prior,
                       .free_weight = config.free_weight,
                       .classes = static_cast<std::uint16_t>(classes.num_classes()),
                       .class_table = class_table_checksum(classes)};
  exchange.configuration_ = exchange.details_.checksum();
  exchange.random_ = mix64((std::uint64_t{config.robot} << 32U) + config.session);
  exchange.contributions_ = arena.take<Contribution>(config.contributions);
  exchange.answers_ = arena.take<Answer>(config.answers);
  exchange.fresh_ = arena.take<Fresh>(config.fresh);
  Result<PeerTable> peers = PeerTable::make(arena, config.peers);
  exchange.batches_ = arena.take<Batch>(kBatches);
  Result<BlockContent> content = BlockContent::make(arena, exchange.num_components_);
  exchange.packed_ = arena.take<std::byte>(most_packed_bytes(exchange.num_components_));
  exchange.coded_ = arena.take<std::byte>(kMostCoded);
  exchange.kept_ = arena.take<std::byte>(kMostKept);
  if (exchange.contributions_.empty() || exchange.answers_.empty() || exchange.fresh_.empty() ||
      !peers.ok() || exchange.batches_.empty() || !content.ok() || exchange.packed_.empty() ||
      exchange.coded_.empty() || exchange.kept_.empty())
    return Status::kResourceExhausted;
  exchange.peers_ = *peers;
  exchange.content_ = *content;
  return exchange;
}

std::int64_t Exchange::random_us(std::int64_t below) noexcept {
  if (below <= 0) return 0;
  random_ += 0x9e3779b97f4a7c15U;
  return static_cast<std::int64_t>(mix64(random_) % static_cast<std::uint64_t>(below));
}

Exchange::Contribution* Exchange::find(const ContributionId& id) noexcept {
  for (Contribution& contribution : contributions_.first(known_)) {
    if (contribution.id == id) return &contribution;
  }
  return nullptr;
}

/// Where there is no place, one of which only the name is known gives its own: who goes on talking
/// of that one will be heard again.
Exchange::Contribution* Exchange::find_or_add(const ContributionId& id, bool own) noexcept {
  if (Contribution* const known = find(id); known != nullptr) return known;
  const std::uint32_t kept =
      config_.own_contributions - std::min(opened_, config_.own_contributions);
  const std::size_t places = contributions_.size() - (own ? 0 : kept);
  Contribution* added = nullptr;
  if (known_ < places) {
    added = &contributions_[known_++];
  } else {
    for (Contribution& other : contributions_.first(known_)) {
      if (!other.open && added == nullptr) added = &other;
    }
    ++(added == nullptr ? counted_.refused_contributions : counted_.displaced_contributions);
    if (added == nullptr) return nullptr;
  }
  *added = {};
  added->id = id;
  added->excluded = is_excluded(id.robot);
  return added;
}

bool Exchange::is_excluded(std::uint32_t robot) const noexcept {
  const std::span<const std::uint32_t> all = std::span(excluded_).first(excluded_count_);
  return std::find(all.begin(), all.end(), robot) != all.end();
}

/// Of what is held of a block: a sum over its parts, so that one can be taken away again.
std::uint64_t Exchange::digest_of(Slot slot, BlockKey key) const noexcept {
  std::uint64_t sum = 0;
  for (const Replicas::Replica* part = store_.replicas->find(slot, key); part != nullptr;
       part = store_.replicas->next_part(*part)) {
    if (part->live == 0) continue;
    sum += mix64(key.bits + mix64((std::uint64_t{part->version} << 8U) + part->live));
  }
  return sum;
}

Result<Replicas::Change> Exchange::put(Contribution& contribution, BlockKey key,
                                       const PartVersion& version, const BlockContent& content,
                                       std::span<const std::byte> coded) noexcept {
  const std::uint64_t before = digest_of(contribution.slot, key);
  const std::size_t packed = pack_block(content, packed_);
  const Result<Replicas::Change> change =
      store_.put(store_.context, contribution.slot, key, version, packed_.first(packed), coded);
  contribution.digest += digest_of(contribution.slot, key) - before;
  return change;
}

Status Exchange::set_frame(Contribution& contribution, const Matrix34d& T_global_map,
                           std::uint32_t revision) const noexcept {
  const Result<GridTransform> frame = GridTransform::make(T_global_map, config_.resolution_m);
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

Status Exchange::open(std::uint32_t epoch, std::uint32_t submap,
                      const Matrix34d& T_global_map) noexcept {
  const ContributionId id{config_.robot, epoch, submap};
  if (!GridTransform::make(T_global_map, config_.resolution_m).ok())
    return Status::kInvalidArgument;
  first_epoch_ = std::min(first_epoch_, epoch);
  const Contribution* const known = find(id);
  if (known != nullptr && known->open) return Status::kInvalidArgument;
  Contribution* const contribution = find_or_add(id, true);
  if (contribution == nullptr) return Status::kResourceExhausted;
  // Whatever was said of it before was not said by this robot.
  *contribution = {};
  contribution->id = id;
  const Status status = set_frame(*contribution, T_global_map, 1);
  if (status != Status::kOk) return status;
  contribution->own = true;
  ++opened_;
  contribution->frame_due_us = 0;
  publishing_ = number_of(*contribution);
  sent_ = 0;
  fresh_count_ = 0;
  announce_due_us_ = 0;
  return Status::kOk;
}

Status Exchange::move(std::uint32_t epoch, std::uint32_t submap,
                      const Matrix34d& T_global_map) noexcept {
  Contribution* const contribution = find({config_.robot, epoch, submap});
  if (contribution == nullptr || !contribution->own) return Status::kInvalidArgument;
  const Status status = set_frame(*contribution, T_global_map, contribution->frame_revision + 1);
  if (status == Status::kOk) contribution->frame_due_us = 0;
  return status;
}

Status Exchange::exclude(std::uint32_t robot) noexcept {
  if (robot == config_.robot) return Status::kInvalidArgument;
  if (is_excluded(robot)) return Status::kOk;
  if (excluded_count_ == excluded_.size()) return Status::kResourceExhausted;
  excluded_[excluded_count_++] = robot;
  for (Contribution& contribution : contributions_.first(known_)) {
    if (contribution.id.robot != robot) continue;
    contribution.excluded = true;
    if (contribution.open) store_.remove(store_.context, contribution.slot);
    contribution.open = false;
    contribution.request_due_us = contribution.frame_due_us = kNever;
    contribution.latest = contribution.announced_frame = contribution.frame_revision = 0;
    contribution.coverage.clear();
    contribution.digest = 0;
    const std::uint32_t number = number_of(contribution);
    drop_answers(number, {1, ~std::uint32_t{0}}, true);
    for (Batch& batch : batches_) {
      if (batch.contribution == number) batch.range = {};
    }
  }
  return Status::kOk;
}

std::uint64_t Exchange::digest() const noexcept {
  // A sum: contributions came in any order.
  std::uint64_t sum = 0;
  for (const Contribution& contribution : contributions_.first(known_)) {
    if (!contribution.open) continue;
    Digest of;
    of.add(contribution.id.robot);
    of.add(std::uint64_t{contribution.id.epoch} << 32U | contribution.id.submap);
    of.add(contribution.frame_revision);
    of.add(contribution.digest);
    sum += of.value();
  }
  return sum;
}

ExchangeReport Exchange::report() const noexcept {
  ExchangeReport report = counted_;
  for (const Contribution& contribution : contributions_.first(known_)) {
    if (contribution.excluded) continue;
    ++report.contributions;
    report.complete += contribution.complete() ? 1U : 0U;
  }
  report.peers = static_cast<std::uint32_t>(peers_.all().size());
  report.waiting_answers = static_cast<std::uint32_t>(waiting_answers_);
  return report;
}

ContributionState Exchange::state_of(const Contribution& contribution) noexcept {
  return {.id = contribution.id,
          .own = contribution.own,
          .complete = contribution.complete(),
          .latest = contribution.latest,
          .covered = contribution.coverage.complete_to(),
          .digest = contribution.digest};
}

std::size_t Exchange::contributions(std::span<ContributionState> into) const noexcept {
  std::size_t count = 0;
  for (const Contribution& one : contributions_.first(known_)) {
    if (one.excluded) continue;
    if (count < into.size()) into[count] = state_of(one);
    ++count;
  }
  return count;
}

Result<ContributionState> Exchange::contribution_at(std::size_t index) const noexcept {
  for (const Contribution& one : contributions_.first(known_)) {
    if (one.excluded) continue;
    if (index == 0) return state_of(one);
    --index;
  }
  return Status::kOutOfRange;
}

}  // namespace tessera
