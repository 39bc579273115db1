// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/exchange.hpp"

#include <algorithm>

#include "tessera/base/internal/bits.hpp"
#include "tessera/base/internal/put_in_place.hpp"

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
         config.max_evidence >= 0.0F && config.teammates <= Teammates::kMost;
}

}  // namespace

Result<Exchange> Exchange::make(Arena& arena, const ExchangeConfig& config,
                                const ReplicaStore& store, const Authenticator& authenticator,
                                const ClassTable& classes, const Signatures& signatures) noexcept {
  Result<Exchange> made = Exchange();
  const Status status = made->set_up(arena, config, store, authenticator, classes, signatures);
  if (status != Status::kOk) made = status;
  return made;
}

Status Exchange::set_up(Arena& arena, const ExchangeConfig& config, const ReplicaStore& store,
                        const Authenticator& authenticator, const ClassTable& classes,
                        const Signatures& signatures) noexcept {
  if (!valid(config) || config.records < store.replicas->config().blocks)
    return Status::kInvalidArgument;
  robot_ = config.robot;
  listen_ = {config.listen_us};
  reach_ = Reach(config);
  const ConfigurationDetails details{.resolution_m = config.resolution_m,
                                     .prior = config.prior,
                                     .free_weight = config.free_weight,
                                     .classes = static_cast<std::uint16_t>(classes.num_classes()),
                                     .class_table = class_table_checksum(classes),
                                     .max_evidence = config.max_evidence,
                                     .conflicts = config.conflicts};
  Status status = put_in_place(
      gate_, [&] { return Gate::make(arena, config, details, authenticator, signatures); });
  if (status == Status::kOk)
    status = put_in_place(ledger_, [&] {
      return Ledger::make(arena, config, store, gate_, classes.num_components());
    });
  if (status == Status::kOk)
    status = put_in_place(repair_, [&] { return Repair::make(arena, config); });
  if (status == Status::kOk)
    status = put_in_place(sender_, [&] { return Sender::make(arena, config); });
  if (status == Status::kOk)
    status = put_in_place(messages_, [&] { return MessageTaker::make(arena, config); });
  if (status == Status::kOk)
    status = put_in_place(teammates_, [&] { return Teammates::make(arena, config.teammates); });
  return status;
}

Status Exchange::open(std::uint32_t epoch, std::uint32_t submap,
                      const Matrix34d& T_global_map) noexcept {
  // The others are to know the extent of the one before it.
  sender_.control().note_extent(ledger_, true);
  const Status status = ledger_.open(epoch, submap, T_global_map, counted_);
  if (status == Status::kOk) sender_.begin_own(ledger_);
  return status;
}

Status Exchange::move(std::uint32_t epoch, std::uint32_t submap,
                      const Matrix34d& T_global_map) noexcept {
  const Status status = ledger_.move(epoch, submap, T_global_map);
  if (status != Status::kOk) return status;
  const Ledger::Contribution& moved = *ledger_.find({robot_, epoch, submap});
  // Announcements say that there is a later frame; the statement that does has its turn.
  sender_.control().owe_frame(ledger_, moved, Instant::long_ago());
  return status;
}

bool Exchange::has_all_of(std::uint32_t submap) const noexcept {
  const std::span<const Ledger::Contribution> places = ledger_.places();
  return std::any_of(places.begin(), places.end(), [&](const Ledger::Contribution& one) {
    return one.used && one.id.robot == robot_ && one.id.submap == submap && one.complete();
  });
}

Status Exchange::open_earlier(std::uint32_t submap, const Matrix34d& T_global_map) noexcept {
  const Status status = ledger_.open_earlier(submap, T_global_map, counted_);
  if (status != Status::kOk) return status;
  const std::uint32_t epoch = ledger_.publishing()->id.epoch;
  sender_.control().owe_frame(ledger_, *ledger_.find({robot_, epoch, submap}), Instant::long_ago());
  return status;
}

Status Exchange::open_session(std::uint32_t submap, const MapSession& session,
                              const Matrix34d& T_global_map) noexcept {
  const Status status = ledger_.open_session(submap, session, T_global_map, counted_);
  if (status == Status::kOk) owe_own(submap);
  return status;
}

Status Exchange::end_session(std::uint32_t submap) noexcept {
  const Status status = ledger_.end_session(submap);
  if (status == Status::kOk) owe_own(submap);
  return status;
}

void Exchange::set_session_floor(std::uint32_t floor) noexcept {
  ledger_.set_session_floor(floor, counted_);
  if (const Ledger::Contribution* const own = ledger_.publishing(); own != nullptr)
    sender_.control().owe_statement(ledger_, *own, Instant::long_ago());
}

/// Frame and statement of a contribution beside the one that is published.
void Exchange::owe_own(std::uint32_t submap) noexcept {
  const std::uint32_t epoch = ledger_.publishing()->id.epoch;
  const Ledger::Contribution& own = *ledger_.find({robot_, epoch, submap});
  sender_.control().owe_frame(ledger_, own, Instant::long_ago());
  sender_.control().owe_statement(ledger_, own, Instant::long_ago());
}

Result<std::uint32_t> Exchange::publish_earlier(std::uint32_t submap, BlockKey key,
                                                const BlockContent& content) noexcept {
  const Result<std::uint32_t> bytes = ledger_.publish_earlier(submap, key, content, counted_);
  if (!bytes.ok()) return bytes;
  const std::uint32_t epoch = ledger_.publishing()->id.epoch;
  sender_.control().owe_statement(ledger_, *ledger_.find({robot_, epoch, submap}),
                                  Instant::long_ago());
  return bytes;
}

std::optional<std::uint32_t> Exchange::earlier_at(std::uint32_t place) const noexcept {
  if (place >= places() || !ledger_.is_earlier(place)) return std::nullopt;
  return ledger_.place(place).id.submap;
}

bool Exchange::move_earlier(std::uint32_t place, const Matrix34d& T_global_map) noexcept {
  const Result<RigidCode> code = encode_rigid(T_global_map);
  if (!code.ok() || place >= places() || !ledger_.move_earlier(place, *code, T_global_map))
    return false;
  sender_.control().owe_frame(ledger_, ledger_.place(place), Instant::long_ago());
  return true;
}

Result<std::uint32_t> Exchange::publish(BlockKey key, const BlockContent& content) noexcept {
  VersionRange published;
  const Result<std::uint32_t> bytes = ledger_.publish(key, content, published, counted_);
  sender_.control().note_extent(ledger_);
  if (published.last >= published.first && published.last != 0) {
    sender_.note_fresh(key, published);
  }
  return bytes;
}

void Exchange::set_floor(std::uint32_t floor) noexcept {
  if (floor < ledger_.floors().own()) return;
  ledger_.end_own(floor, counted_);
  sender_.begin_own(ledger_);
}

void Exchange::set_floor_of(std::uint32_t robot, std::uint32_t floor) noexcept {
  ledger_.note_floor(robot, floor, false, counted_);
}

Status Exchange::exclude(std::uint32_t robot) noexcept {
  if (robot == robot_) return Status::kInvalidArgument;
  const Status status = gate_.exclude(robot);
  if (status == Status::kOk) {
    ledger_.remove_robot(robot);
    teammates_.forget(robot);
  }
  return status;
}

/// At the first call the clock is known.
bool Exchange::is_listening(Instant now) noexcept {
  if (started_ == Instant::long_ago()) started_ = now;
  return now - started_ < listen_;
}

void Exchange::receive(std::span<const std::byte> datagram, std::int64_t now_us) noexcept {
  Heard heard;
  const Instant now = Instant::at_us(now_us);
  static_cast<void>(is_listening(now));
  heard.describing = repair_.comparison().describing();
  if (!gate_.accept(datagram, now, heard, counted_)) return;
  hear_presence(heard);
  messages_.hear({gate_, ledger_, repair_, sender_, counted_}, heard);
}

/// Of datagrams that overtook each other the last one counts.
void Exchange::hear_presence(const Heard& heard) noexcept {
  const DatagramHeader& header = heard.header;
  if (!heard.is_last) return;
  if (header.kind == DatagramKind::kLeave) teammates_.forget(header.sender);
  if (!heard.presence) return;
  const bool is_taken = teammates_.hear(header.sender, header.session, *heard.presence, heard.now);
  ++(is_taken ? counted_.presences_taken : counted_.refused_presences);
}

std::size_t Exchange::send(std::int64_t now_us, std::span<std::byte> into) noexcept {
  const Instant now = Instant::at_us(now_us);
  if (is_listening(now)) return 0;
  repair_.end_comparison(ledger_, gate_.peers(), now);
  static_cast<void>(reach_.tick(ledger_, repair_, now, counted_));
  return sender_.send(gate_, ledger_, repair_, now, into, counted_);
}

ExchangeReport Exchange::report() const noexcept {
  ExchangeReport report = counted_;
  for (const Ledger::Contribution& contribution : ledger_.places()) {
    if (!contribution.used) continue;
    ++report.contributions;
    const bool complete = ledger_.lacks_nothing(contribution);
    report.complete += complete ? 1U : 0U;
    report.far_contributions += contribution.is_far() && !complete ? 1U : 0U;
  }
  report.contributions += ledger_.far().size();
  report.far_contributions += ledger_.far().size();
  report.banned = static_cast<std::uint32_t>(gate_.banned().size());
  report.peers = static_cast<std::uint32_t>(gate_.peers().all().size());
  report.waiting_answers = static_cast<std::uint32_t>(sender_.answers().waiting());
  return report;
}

std::uint32_t Exchange::peers_agreeing(std::int64_t now_us) const noexcept {
  return messages_.announcements().peers_agreeing(gate_.peers(), report().contributions,
                                                  Instant::at_us(now_us));
}

namespace {

ContributionState state_of(const Ledger& ledger,
                           const Ledger::Contribution& contribution) noexcept {
  return {.id = contribution.id,
          .own = contribution.own,
          .complete = ledger.lacks_nothing(contribution),
          .far = contribution.is_far(),
          .latest = contribution.own ? contribution.latest : contribution.statement.latest,
          .covered = contribution.coverage.complete_to(),
          .records = contribution.records,
          .digest = contribution.said().folded(),
          .session = contribution.session};
}

ContributionState state_of(const Ledger& /*ledger*/, const FarContribution& far) noexcept {
  return {.id = far.id(),
          .far = true,
          .latest = far.statement.latest,
          .digest = far.statement.fingerprint.folded(),
          .session = far.session};
}

/// Calls visit(state()) for each; false: no more.
template <class Visit>
void for_contributions(const Ledger& ledger, Visit&& visit) noexcept {
  for (const Ledger::Contribution& one : ledger.places()) {
    if (one.used && !visit(one)) return;
  }
  for (const FarContribution& one : ledger.far().places()) {
    if (one.used && !visit(one)) return;
  }
}

}  // namespace

std::size_t Exchange::contributions(std::span<ContributionState> into) const noexcept {
  std::size_t count = 0;
  for_contributions(ledger_, [&](const auto& one) {
    if (count < into.size()) into[count] = state_of(ledger_, one);
    ++count;
    return true;
  });
  return count;
}

Result<ContributionState> Exchange::contribution_at(std::size_t index) const noexcept {
  Result<ContributionState> found = Status::kOutOfRange;
  for_contributions(ledger_, [&](const auto& one) {
    if (index == 0) found = state_of(ledger_, one);
    return index-- != 0;
  });
  return found;
}

}  // namespace tessera
