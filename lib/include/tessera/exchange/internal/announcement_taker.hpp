// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What robots announce that they hold, and proofs of conflicts, which go to those who announce
// without knowing of them.
#pragma once

#include "tessera/exchange/internal/exchange_parts.hpp"

namespace tessera {

class AnnouncementTaker {
 public:
  explicit AnnouncementTaker(const ExchangeConfig& config) noexcept
      : robot_(config.robot), answer_{config.answer_us}, announce_{config.announce_us} {}
  AnnouncementTaker() noexcept = default;

  /// False iff the body is no announcement, and nothing came of it. O(contributions).
  [[nodiscard]] bool hear(const ExchangeParts& parts, const Heard& heard) noexcept;
  /// False iff the body is no proof of a conflict, or the fleet does not sign. At most two checks
  /// of signatures.
  [[nodiscard]] static bool hear_conflict(const ExchangeParts& parts, const Heard& heard) noexcept;
  /// What new proofs end. O(1), or O(proofs contributions) where one is new.
  void judge_conflicts(const ExchangeParts& parts) noexcept;
  /// As Exchange::peers_agreeing. contributions: that are held.
  [[nodiscard]] std::uint32_t peers_agreeing(const PeerTable& peers, std::uint32_t contributions,
                                             Instant now) const noexcept;

 private:
  void hear_announced(const ExchangeParts& parts, const Heard& heard,
                      const AnnouncedContribution& announced) const noexcept;
  void owe_conflict(const ExchangeParts& parts, const Heard& heard,
                    const ContributionId& id) const noexcept;

  std::uint32_t robot_ = 0;
  Duration answer_{};
  Duration announce_{};
  std::size_t judged_ = 0;  ///< Of the proofs of conflicts.
};

}  // namespace tessera
