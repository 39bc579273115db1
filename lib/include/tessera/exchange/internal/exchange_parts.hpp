// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tessera/exchange/internal/sender.hpp"

namespace tessera {

/// Announcements that one misses before it counts as silent.
inline constexpr std::int64_t kSilences = 3;

/// The parts of an exchange, for what is heard.
struct ExchangeParts {
  Gate& gate;
  Ledger& ledger;
  Repair& repair;
  Sender& sender;
  ExchangeReport& counted;

  /// True iff its origin is heard of a contribution: without signatures nobody else is believed
  /// then, as one who missed what its origin said would bring back what it has put right.
  [[nodiscard]] bool origin_speaks(const ContributionId& id, Instant origin_at, const Heard& heard,
                                   Duration announce) const noexcept {
    return !gate.signatures().on() && heard.header.sender != id.robot &&
           heard.now - origin_at <= kSilences * announce;
  }
  [[nodiscard]] bool origin_speaks(const HeldContribution& contribution, const Heard& heard,
                                   Duration announce) const noexcept {
    return origin_speaks(contribution.id, contribution.origin_at, heard, announce);
  }
  /// The same of one that is far, if there is one of this name.
  [[nodiscard]] bool far_origin_speaks(const ContributionId& id, const Heard& heard,
                                       Duration announce) const noexcept {
    const FarContribution* const far = ledger.far().find(id);
    return far != nullptr && origin_speaks(id, far->origin_at, heard, announce);
  }
  /// True iff nothing is taken of a contribution that this datagram names: its robot is excluded,
  /// or, without signatures, is heard and says itself what it publishes in this epoch and later
  /// ones. What it has denied would come back from others, whom it has not reached yet, for ever.
  [[nodiscard]] bool is_refused(const ContributionId& id, const Heard& heard,
                                Duration announce) const noexcept {
    if (gate.is_excluded(id.robot)) return true;
    if (gate.signatures().on() || id.robot == heard.header.sender) return false;
    const Peer* const peer = gate.peers().find(id.robot);
    return peer != nullptr && peer->epoch && id.epoch >= *peer->epoch &&
           heard.now - peer->heard <= kSilences * announce && ledger.find(id) == nullptr &&
           ledger.far().find(id) == nullptr;
  }
};

}  // namespace tessera
