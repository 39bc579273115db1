// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Making it, what this robot says, and how things stand.
#include "tessera/exchange/exchange.hpp"

#include <algorithm>

#include "tessera/base/internal/bits.hpp"

namespace tessera {

namespace {

bool valid(const ExchangeConfig& config) noexcept {
  return config.contributions > config.own_contributions && config.own_contributions >= 1 &&
         config.contributions <= Replicas::kMostContributions &&
         config.contributions_per_robot >= 1 && config.records >= 1 && config.peers >= 1 &&
         config.answers >= 1 && config.picks >= 1 && config.fresh >= 1 &&
         config.burst_bytes >= kMostDatagramBytes && config.announce_us > 0 &&
         config.announce_soon_us > 0 && config.request_us > 0 &&
         config.request_most_us >= config.request_us &&
         config.request_idle_us >= config.request_most_us && config.bytes_per_s > 0 &&
         config.answer_us > 0 && config.frame_us >= 0 && config.listen_us >= 0 &&
         config.max_evidence >= 0.0F;
}

}  // namespace

Result<Exchange> Exchange::make(Arena& arena, const ExchangeConfig& config,
                                const ReplicaStore& store, const Authenticator& authenticator,
                                const ClassTable& classes, const Signatures& signatures) noexcept {
  if (!valid(config) || config.records < store.replicas->config().blocks)
    return Status::kInvalidArgument;
  Exchange exchange;
  exchange.robot_ = config.robot;
  exchange.answer_ = {config.answer_us};
  exchange.announce_ = {config.announce_us};
  exchange.listen_ = {config.listen_us};
  const ConfigurationDetails details{.resolution_m = config.resolution_m,
                                     .prior = config.prior,
                                     .free_weight = config.free_weight,
                                     .classes = static_cast<std::uint16_t>(classes.num_classes()),
                                     .class_table = class_table_checksum(classes),
                                     .max_evidence = config.max_evidence,
                                     .conflicts = config.conflicts};
  Result<Gate> gate = Gate::make(arena, config, details, authenticator, signatures);
  if (!gate.ok()) return gate.status();
  exchange.gate_ = *gate;
  Result<Ledger> ledger =
      Ledger::make(arena, config, store, exchange.gate_, classes.num_components());
  if (!ledger.ok()) return ledger.status();
  exchange.ledger_ = *ledger;
  Result<Repair> repair = Repair::make(arena, config);
  Result<Sender> sender = Sender::make(arena, config);
  exchange.requested_ = arena.take<RequestedContribution>(1).data();
  exchange.description_ = arena.take<Description>(1).data();
  if (!repair.ok() || !sender.ok() || exchange.requested_ == nullptr ||
      exchange.description_ == nullptr)
    return Status::kResourceExhausted;
  exchange.repair_ = *repair;
  exchange.sender_ = *sender;
  return exchange;
}

Status Exchange::open(std::uint32_t epoch, std::uint32_t submap,
                      const Matrix34d& T_global_map) noexcept {
  const Status status = ledger_.open(epoch, submap, T_global_map, counted_);
  if (status == Status::kOk) sender_.begin_own(ledger_);
  return status;
}

Status Exchange::move(std::uint32_t epoch, std::uint32_t submap,
                      const Matrix34d& T_global_map) noexcept {
  const Status status = ledger_.move(epoch, submap, T_global_map);
  if (status != Status::kOk) return status;
  const Ledger::Contribution& moved = *ledger_.find({robot_, epoch, submap});
  sender_.owe_frame(ledger_, moved, Instant::long_ago());
  sender_.owe_statement(ledger_, moved, Instant::long_ago());
  return status;
}

Result<std::uint32_t> Exchange::publish(BlockKey key, const BlockContent& content) noexcept {
  VersionRange published;
  const Result<std::uint32_t> bytes = ledger_.publish(key, content, published, counted_);
  if (published.last >= published.first && published.last != 0) {
    sender_.note_fresh(key, published);
    sender_.announce_soon();
  }
  return bytes;
}

void Exchange::set_floor(std::uint32_t floor) noexcept {
  if (floor < ledger_.own_floor()) return;
  ledger_.end_own(floor, counted_);
  sender_.begin_own(ledger_);
}

void Exchange::set_floor_of(std::uint32_t robot, std::uint32_t floor) noexcept {
  ledger_.note_floor(robot, floor, false, counted_);
}

Status Exchange::exclude(std::uint32_t robot) noexcept {
  if (robot == robot_) return Status::kInvalidArgument;
  const Status status = gate_.exclude(robot);
  if (status == Status::kOk) ledger_.remove_robot(robot);
  return status;
}

/// At the first call the clock is known.
bool Exchange::is_listening(Instant now) noexcept {
  if (started_ == Instant::long_ago()) started_ = now;
  return now - started_ < listen_;
}

std::size_t Exchange::send(std::int64_t now_us, std::span<std::byte> into) noexcept {
  const Instant now = Instant::at_us(now_us);
  if (is_listening(now)) return 0;
  repair_.end_comparison(ledger_, gate_.peers(), now);
  return sender_.send(gate_, ledger_, repair_, now, into, counted_);
}

ExchangeReport Exchange::report() const noexcept {
  ExchangeReport report = counted_;
  for (const Ledger::Contribution& contribution : ledger_.places()) {
    if (!contribution.used) continue;
    ++report.contributions;
    report.complete += contribution.complete() ? 1U : 0U;
  }
  report.banned = static_cast<std::uint32_t>(gate_.banned().size());
  report.peers = static_cast<std::uint32_t>(gate_.peers().all().size());
  report.waiting_answers = static_cast<std::uint32_t>(sender_.answers().waiting());
  return report;
}

ContributionState Exchange::state_of(const Ledger::Contribution& contribution) noexcept {
  return {.id = contribution.id,
          .own = contribution.own,
          .complete = contribution.complete(),
          .latest = contribution.own ? contribution.latest : contribution.statement.latest,
          .covered = contribution.coverage.complete_to(),
          .records = contribution.records,
          .digest = contribution.held.folded()};
}

std::size_t Exchange::contributions(std::span<ContributionState> into) const noexcept {
  std::size_t count = 0;
  for (const Ledger::Contribution& one : ledger_.places()) {
    if (!one.used) continue;
    if (count < into.size()) into[count] = state_of(one);
    ++count;
  }
  return count;
}

Result<ContributionState> Exchange::contribution_at(std::size_t index) const noexcept {
  for (const Ledger::Contribution& one : ledger_.places()) {
    if (!one.used) continue;
    if (index == 0) return state_of(one);
    --index;
  }
  return Status::kOutOfRange;
}

namespace {

/// Of the bytes of a block, what its free-only voxels take, as real maps have it.
std::uint32_t free_bytes(const BlockContent& content, std::uint32_t bytes) noexcept {
  constexpr std::uint32_t kVoxelsOfByte = 14;
  const std::uint64_t labelled = content.label_octets();
  if (labelled == 0) return bytes;
  const auto octets = static_cast<std::uint32_t>(count_ones(content.pass_octets() & ~labelled));
  return std::min(bytes, octets * kOctetVoxels / kVoxelsOfByte);
}

}  // namespace

/// Named, so that the gate of the stack knows who calls them.
struct ExchangePublication {
  static void quantise(void* /*context*/, BlockContent& content) { tessera::quantise(content); }
  static bool read(void* context, BlockKey key, BlockContent& content) {
    return static_cast<const Exchange*>(context)->read_published(key, content);
  }
  static Result<WireBytes> publish(void* context, BlockKey key, const BlockContent& content) {
    const Result<std::uint32_t> bytes = static_cast<Exchange*>(context)->publish(key, content);
    if (!bytes.ok()) return bytes.status();
    const std::uint32_t free = free_bytes(content, *bytes);
    return WireBytes{.labels = *bytes - free, .free = free};
  }
};

Publication publication_of(Exchange& exchange) noexcept {
  return {.context = &exchange,
          .quantise = ExchangePublication::quantise,
          .read = ExchangePublication::read,
          .publish = ExchangePublication::publish};
}

}  // namespace tessera
