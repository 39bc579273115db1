// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What this robot publishes, in this start and in earlier ones.
#include <algorithm>

#include "tessera/exchange/internal/ledger.hpp"
#include "tessera/frames/frame_statements.hpp"

namespace tessera {

Status Ledger::open(std::uint32_t epoch, std::uint32_t submap, const Matrix34d& T_global_map,
                    ExchangeReport& counted) noexcept {
  if (!is_map({robot_, epoch, submap})) return Status::kInvalidArgument;
  const Result<Contribution*> opened = open_own({robot_, epoch, submap}, T_global_map, {}, counted);
  if (!opened.ok()) return opened.status();
  table_.publish_as(**opened);
  floors_.begin(epoch);
  return Status::kOk;
}

Result<Ledger::Contribution*> Ledger::open_own(const ContributionId& id,
                                               const Matrix34d& T_global_map,
                                               const MapSession& session,
                                               ExchangeReport& counted) noexcept {
  if (!GridTransform::make(T_global_map, resolution_m_).ok() || id.epoch < floors_.own())
    return Status::kInvalidArgument;
  floors_.claim(id.epoch);
  Contribution* known = find(id);
  if ((known != nullptr && known->open) || table_.far().find(id) != nullptr)
    return Status::kInvalidArgument;
  // Whatever was said of it before was not said by this process.
  if (known != nullptr) table_.drop(*known);
  Contribution* const contribution =
      table_.add(id, ContributionTable::Claim::kOwn, Instant::long_ago(), counted);
  if (contribution == nullptr) return Status::kResourceExhausted;
  const Status status = table_.set_frame(*contribution, T_global_map, 1, session);
  if (status == Status::kOk) return contribution;
  table_.drop(*contribution);
  return status;
}

Status Ledger::open_earlier(std::uint32_t submap, const Matrix34d& T_global_map,
                            ExchangeReport& counted) noexcept {
  const Contribution* const now = table_.publishing();
  if (now == nullptr || submap >= now->id.submap) return Status::kInvalidArgument;
  const Result<Contribution*> opened =
      open_own({robot_, now->id.epoch, submap}, T_global_map, {}, counted);
  if (opened.ok()) table_.own_as(**opened);
  return opened.status();
}

Status Ledger::open_session(std::uint32_t submap, const MapSession& session,
                            const Matrix34d& T_global_map, ExchangeReport& counted) noexcept {
  const Contribution* const now = table_.publishing();
  if (now == nullptr || !MapSession::is(submap) || session.weight == 0 ||
      session.weight > MapSession::kFullWeight)
    return Status::kInvalidArgument;
  const Result<Contribution*> opened =
      open_own({robot_, now->id.epoch, submap}, T_global_map, session, counted);
  if (opened.ok()) table_.own_as(**opened);
  return opened.status();
}

Status Ledger::end_session(std::uint32_t submap) noexcept {
  const Contribution* const now = table_.publishing();
  Contribution* const own = now == nullptr ? nullptr : find({robot_, now->id.epoch, submap});
  if (own == nullptr || !own->own || !MapSession::is(submap)) return Status::kInvalidArgument;
  MapSession ended = own->session;
  ended.weight = 0;
  return table_.set_frame(*own, own->T_global_map, own->frame_revision + 1, ended);
}

void Ledger::set_session_floor(std::uint32_t floor, ExchangeReport& counted) noexcept {
  if (floor < floors_.own_sessions()) return;
  floors_.set_own_sessions(floor);
  drop_sessions_below(robot_, floor, counted);
}

Result<std::uint32_t> Ledger::publish_earlier(std::uint32_t submap, BlockKey key,
                                              const BlockContent& content,
                                              ExchangeReport& counted) noexcept {
  const Contribution* const now = table_.publishing();
  if (now == nullptr) return Status::kInvalidArgument;
  Contribution* const own = find({robot_, now->id.epoch, submap});
  if (own == nullptr || !own->own) return Status::kInvalidArgument;
  VersionRange published;
  return maker_.publish({table_, records_, content_, counted}, *own, key, content, published);
}

/// A contribution without blocks, in the epoch of the one that is published.
Result<Ledger::Contribution*> Ledger::open_once(std::uint32_t submap,
                                                ExchangeReport& counted) noexcept {
  const Contribution* const now = table_.publishing();
  if (now == nullptr) return Status::kInvalidArgument;
  const ContributionId id{robot_, now->id.epoch, submap};
  Contribution* const known = find(id);
  if (known != nullptr && known->own) return known;
  const Result<Contribution*> opened = open_own(id, Matrix34d::Identity(), {}, counted);
  if (opened.ok()) table_.own_as(**opened);
  return opened;
}

Result<std::uint32_t> Ledger::object(const Objection& objection, ExchangeReport& counted) noexcept {
  const Result<Contribution*> own = open_once(Objection::kNumber, counted);
  if (!own.ok()) return own.status();
  std::array<std::byte, Objection::kMostBytes> bytes{};
  const std::size_t size = objection.write(bytes);
  return maker_.publish_bytes({table_, records_, content_, counted}, **own,
                              Objection::place_of(objection.against, objection.key),
                              std::span(bytes).first(size));
}

Result<std::uint32_t> Ledger::state(BlockKey place, std::span<const std::byte> statement,
                                    ExchangeReport& counted) noexcept {
  const Result<Contribution*> own = open_once(FrameStatements::kNumber, counted);
  if (!own.ok()) return own.status();
  const auto holds = [&](BlockKey key) { return replicas().find((*own)->slot, key) != nullptr; };
  const std::uint32_t links =
      replicas().contribution((*own)->slot).blocks - (holds(kPlaceOfPrior) ? 1U : 0U);
  if (place != kPlaceOfPrior && links >= FrameStatements::kMostLinks && !holds(place))
    return Status::kResourceExhausted;
  return maker_.publish_bytes({table_, records_, content_, counted}, **own, place, statement);
}

Status Ledger::move(std::uint32_t epoch, std::uint32_t submap,
                    const Matrix34d& T_global_map) noexcept {
  Contribution* const contribution = find({robot_, epoch, submap});
  if (contribution == nullptr || !contribution->own) return Status::kInvalidArgument;
  return table_.set_frame(*contribution, T_global_map, contribution->frame_revision + 1,
                          contribution->session);
}

bool Ledger::is_earlier(std::uint32_t number) const noexcept {
  const Contribution& one = table_.place(number);
  return one.used && one.open && !one.own && one.id.robot == robot_ && !is_of_this_process(one.id);
}

/// No revision is signed twice: those of each start begin above those of the start before, even
/// where that one's frames are not heard any more.
bool Ledger::move_earlier(std::uint32_t number, const RigidCode& code,
                          const Matrix34d& T_global_map) noexcept {
  Contribution& one = table_.place(number);
  if (!is_earlier(number)) return false;
  const Result<RigidCode> held = encode_rigid(one.T_global_map);
  if (held.ok() && *held == code) return false;
  constexpr std::uint64_t kMostStarts = 0xffff;
  const auto first = static_cast<std::uint32_t>(std::min(session_ >> 32U, kMostStarts)) << 16U;
  const std::uint32_t revision = std::max(one.frame_revision + 1, first);
  if (revision - first > 0xffff || table_.set_frame(one, T_global_map, revision) != Status::kOk)
    return false;
  one.moved = true;
  return true;
}

Result<std::uint32_t> Ledger::publish(BlockKey key, const BlockContent& content,
                                      VersionRange& published, ExchangeReport& counted) noexcept {
  Contribution* const own = table_.publishing();
  if (own == nullptr) return Status::kInvalidArgument;
  return maker_.publish({table_, records_, content_, counted}, *own, key, content, published);
}

bool Ledger::read_published(BlockKey key, BlockContent& content) const noexcept {
  const Contribution* const own = table_.publishing();
  return own != nullptr && records_.read_block(*own, key, content);
}

Statement Ledger::statement_of(const Contribution& own, VersionRange range) const noexcept {
  return {.id = own.id,
          .range = range,
          .latest = own.latest,
          .records = own.records,
          .fingerprint = own.held,
          .frame_revision = own.frame_revision,
          .floor = floors_.own(),
          .session_floor = std::min(floors_.own_sessions(), own.id.epoch),
          .session = session_};
}

void Ledger::end_own(std::uint32_t floor, ExchangeReport& counted) noexcept {
  floors_.end_own(floor);
  table_.end_own();
  drop_below(robot_, floor, counted);
}

}  // namespace tessera
