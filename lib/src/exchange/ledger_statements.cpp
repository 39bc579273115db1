// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What origins state: floors of epochs, and what there is.
#include <algorithm>

#include "tessera/exchange/internal/ledger.hpp"

namespace tessera {

namespace {

/// Epochs that a robot goes up at once by what nobody has signed.
constexpr std::uint32_t kMostEpochs = 1U << 16U;
/// Claims of floors that one process follows: some robots may know of higher ones than others.
constexpr std::uint32_t kMostClaimsOfFloors = 3;

}  // namespace

std::uint32_t Ledger::floor_of(std::uint32_t robot) const noexcept {
  if (robot == robot_) return own_floor_;
  for (const RobotFloor& known : floors()) {
    if (known.robot == robot) return known.floor;
  }
  return 0;
}

/// Where there is no place, a robot of which nothing is held gives its own.
RobotFloor* Ledger::floor_place(std::uint32_t robot) noexcept {
  const auto known = floors_.first(floor_count_);
  for (RobotFloor& one : known) {
    if (one.robot == robot) return &one;
  }
  if (floor_count_ < floors_.size()) return &floors_[floor_count_++];
  for (RobotFloor& one : known) {
    const bool held = std::any_of(contributions_.begin(), contributions_.end(),
                                  [&](const Contribution& contribution) {
                                    return contribution.used && contribution.id.robot == one.robot;
                                  });
    if (!held) return &one;
  }
  return nullptr;
}

void Ledger::note_floor(std::uint32_t robot, std::uint32_t floor, bool may_fall,
                        ExchangeReport& counted) noexcept {
  const std::uint32_t known = floor_of(robot);
  if (robot == robot_ || floor == known || (floor < known && !may_fall)) return;
  RobotFloor* const place = floor_place(robot);
  if (place == nullptr) return;
  *place = {robot, floor};
  drop_below(robot, floor, counted);
}

void Ledger::drop_below(std::uint32_t robot, std::uint32_t floor,
                        ExchangeReport& counted) noexcept {
  for (Contribution& contribution : contributions_) {
    if (!contribution.used || contribution.id.robot != robot || contribution.id.epoch >= floor)
      continue;
    if (contribution.own && number_of(contribution) == publishing_) publishing_ = kNobody;
    drop(contribution);
    ++counted.ended_contributions;
  }
}

void Ledger::end_own(std::uint32_t floor, ExchangeReport& counted) noexcept {
  own_floor_ = floor;
  first_epoch_ = ~std::uint32_t{0};
  opened_ = 0;
  drop_below(robot_, floor, counted);
}

/// Said in this robot's name, and not by this process. What is of an earlier epoch may be.
bool Ledger::note_overtaken(const Statement& statement) noexcept {
  if (statement.session == session_) {
    // Without signatures others can say it too: it is theirs if this process has not come to it.
    const Contribution* const own = find(statement.id);
    const bool is_ours = own == nullptr ? statement.id.epoch < first_epoch_
                                        : !own->own || statement.latest <= own->latest;
    if (is_ours) return false;
  } else {
    highest_session_ = std::max(highest_session_, statement.session);
    if (statement.id.epoch < first_epoch_ && statement.floor <= own_floor_) return false;
  }
  const std::uint32_t epoch = std::max(statement.id.epoch, statement.floor);
  // Where nobody signs, the others forget it when they hear this robot.
  if (!signatures_.on() && !may_rise_to(epoch)) return false;
  overtaken_ = std::max(overtaken_.value_or(0), epoch);
  return true;
}

/// Nobody has signed that there is such an epoch.
bool Ledger::may_rise_to(std::uint32_t epoch) const noexcept {
  const std::uint32_t own_epoch = publishing() == nullptr ? own_floor_ : publishing()->id.epoch;
  return epoch <= own_epoch || epoch - own_epoch <= kMostEpochs;
}

void Ledger::note_floor_claim(std::uint32_t floor) noexcept {
  const Contribution* const own = publishing();
  if (own == nullptr || floor <= own->id.epoch || !may_rise_to(floor) ||
      (overtaken_ && floor <= *overtaken_) || floor_claims_ == kMostClaimsOfFloors)
    return;
  ++floor_claims_;
  overtaken_ = std::max(overtaken_.value_or(0), floor);
}

bool Ledger::take_statement(const Statement& statement, std::span<const std::byte> proof,
                            bool is_last, Instant now, ExchangeReport& counted) noexcept {
  Contribution* known = find(statement.id);
  // What is held already is not worth the check of a signature.
  const bool replaces = !signatures_.on() && is_last;
  if (known != nullptr && known->stated && !replaces && known->statement.agrees_with(statement) &&
      !statement.is_newer_than(known->statement))
    return true;
  if (signatures_.on() && !proof_check_.check(signatures_, configuration_, statement.id,
                                              leaf_of(signatures_, statement), proof))
    return false;
  if (statement.id.robot == robot_ && note_overtaken(statement)) ++counted.impostors;
  if (is_of_this_process(statement.id)) return true;
  note_floor(statement.id.robot, statement.floor, replaces, counted);
  if (known == nullptr) known = note_name(statement.id, now, counted);
  if (known == nullptr || known->own) return true;
  keep_statement(*known, statement, replaces, proof, counted);
  return true;
}

void Ledger::keep_statement(Contribution& contribution, const Statement& statement, bool replaces,
                            std::span<const std::byte> proof, ExchangeReport& counted) noexcept {
  const bool contradicts = contribution.stated && !contribution.statement.agrees_with(statement);
  if (contradicts) note_conflict(contribution, statement, proof, counted);
  if (contribution.stated && !replaces && !statement.is_newer_than(contribution.statement)) return;
  if (contradicts && !signatures_.on()) ++counted.conflicts;
  contribution.stated = true;
  contribution.statement = statement;
  // Nobody signed what ranges of relayed chunks are beyond.
  if (!contribution.own) contribution.coverage.trim(statement.latest);
  contribution.latest =
      replaces ? statement.latest : std::max(contribution.latest, statement.latest);
  contribution.proof_bytes = static_cast<std::uint8_t>(proof.size());
  std::copy(proof.begin(), proof.end(), contribution.proof.begin());
}

/// Its leaf is the last of the tree that take_chunk() grew.
void Ledger::take_chunk_statement(Contribution& contribution, const Statement& statement,
                                  bool is_last, ExchangeReport& counted) noexcept {
  std::array<std::byte, kMostProofBytes> proof{};
  std::size_t bytes = 0;
  if (signatures_.on()) bytes = write_proof(*tree_, tree_->count() - 1, signature_, proof);
  note_floor(statement.id.robot, statement.floor, false, counted);
  if (!contribution.used) return;
  keep_statement(contribution, statement, !signatures_.on() && is_last,
                 std::span(proof).first(bytes), counted);
}

}  // namespace tessera
