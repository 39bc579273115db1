// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What this robot lacks, and when it asks whom for it: statements, frames, gaps in versions, and,
// where the versions are the same and the contents are not, a comparison with one robot.
#pragma once

#include "tessera/exchange/internal/comparison.hpp"

namespace tessera {

class Repair {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config) noexcept {
    return arena_bytes<Need>(config.contributions) + arena_bytes<Claim>(2 * kMostClaims) +
           arena_bytes<VersionRange>(kMostGapsAsked) + arena_bytes<RequestedContribution>(1) +
           Comparison::required_bytes();
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<Repair> make(Arena& arena, const ExchangeConfig& config) noexcept;
  Repair() noexcept = default;

  /// What a peer said that it has of a contribution.
  void note_announced(Ledger& ledger, Ledger::Contribution& contribution,
                      const AnnouncedContribution& announced, const Peer& peer, Instant now,
                      ExchangeReport& counted) noexcept;
  /// Somebody holds something else in this robot's name than this process published: what was
  /// stated about it is asked for.
  void note_claim(const ContributionId& id, const Peer& peer, Instant now) noexcept {
    note(claims_.first(kMostClaims), peer, {id, true, ~std::uint32_t{0}, now});
  }
  /// A name that found no place, and whose frame would displace a lower one of its robot: that is
  /// asked for.
  void note_displacing(const ContributionId& id, const Peer& peer, Instant now) noexcept {
    note(claims_.last(kMostClaims), peer, {id, true, 0, now});
  }
  /// Somebody knows more of a far one.
  void note_behind(const FarContribution& far, const Peer& peer, Instant now) noexcept {
    note(claims_.last(kMostClaims), peer,
         {far.id(), true, far.frame_revision, now, true, far.statement.latest});
  }
  /// What a chunk did; fills: it is relayed, or of versions that were known of before.
  void note_taken(Ledger& ledger, Ledger::Contribution& contribution, const Ledger::Taken& taken,
                  bool fills, std::uint32_t sender, Instant now) noexcept;
  /// Sees to it that what is lacking is asked for, or no more.
  void note_lack(Ledger& ledger, Ledger::Contribution& contribution, Instant now) noexcept;
  /// There is room again for what found none: it is asked for at once.
  void note_room(const Ledger& ledger, Ledger::Contribution& contribution, Instant now) noexcept {
    contribution.full = false;
    Need& need = need_of(ledger, contribution);
    need.pause = request_;
    if (need.due != Instant::never()) need.due = std::min(need.due, now + random(request_));
  }
  /// Another robot asked for gaps of which this one lacks some too: it waits for the answer.
  void note_asked(const Ledger& ledger, const Ledger::Contribution& contribution, Instant now,
                  ExchangeReport& counted) noexcept;
  /// Writes all that is due and fits. False: nothing.
  [[nodiscard]] bool write(Ledger& ledger, ByteWriter& to, Instant now,
                           ExchangeReport& counted) noexcept;
  [[nodiscard]] Comparison& comparison() noexcept { return comparison_; }
  /// Ends a comparison that is over, and says when the next may begin.
  void end_comparison(Ledger& ledger, PeerTable& peers, Instant now) noexcept;
  /// At random, from 0 to below.
  [[nodiscard]] Duration random(Duration below) noexcept;

 private:
  /// By place of the contribution.
  struct Need {
    std::uint32_t generation = 0;
    std::uint32_t requests = 0;  ///< Since something came of one.
    Instant due = Instant::never();
    Duration pause{};                      ///< Until it is asked for again.
    Instant different;                     ///< When a robot was heard that holds something else.
    Instant taken;                         ///< When a record came last.
    Instant filled;                        ///< The same of one that fills.
    Instant unsettled = Instant::never();  ///< Since when records come and contents differ.
    Instant asked;                         ///< When it was asked for, or the lack was noticed.
    /// Gaps up to here are asked for, and the rest with the next datagram; 0: all are.
    std::uint32_t asked_to = 0;
    std::uint32_t announced = 0;  ///< Of a newer statement, the latest version; 0: of none.
    Instant compare_due;
    Duration compare_pause{};
  };
  /// A contribution that has no place here, and of which something is asked for.
  struct Claim {
    ContributionId id;
    bool wanted = false;
    std::uint32_t frame_revision = 0;  ///< As in the request; the highest: of no interest.
    Instant noted;
    bool stated = false;  ///< As in the request; so is the next one.
    std::uint32_t latest = 0;
  };
  static constexpr std::size_t kMostClaims = 4;
  /// Gaps of a contribution that are asked for at once.
  static constexpr std::size_t kMostGapsAsked = 256;
  /// Between requests for newer statements of a far one, which its origin sends too.
  static constexpr Duration kFarPause{8'000'000};
  /// Requests without an answer after which nobody is expected to have it.
  static constexpr std::uint32_t kPatience = 16;

  [[nodiscard]] Need& need_of(const Ledger& ledger,
                              const Ledger::Contribution& contribution) noexcept;
  [[nodiscard]] static bool lacks_versions(const Ledger::Contribution& contribution) noexcept {
    return !contribution.open || !contribution.stated ||
           (!contribution.far &&
            contribution.coverage.complete_to() < contribution.statement.latest) ||
           contribution.sure_frame() <
               std::max(contribution.statement.frame_revision, contribution.announced_frame);
  }
  [[nodiscard]] bool write_gaps(const Ledger::Contribution& contribution, Need& need,
                                ByteWriter& to, Instant now) noexcept;
  void consider_comparison(Ledger& ledger, const Ledger::Contribution& contribution, Need& need,
                           const AnnouncedContribution& announced, const Peer& peer, Instant now,
                           ExchangeReport& counted) noexcept;
  static void note(std::span<Claim> claims, const Peer& peer, const Claim& noted) noexcept;
  void begin_request(const Ledger::Contribution& contribution) noexcept;
  [[nodiscard]] bool write_comparison(Ledger& ledger, ByteWriter& to) noexcept;
  void put_off(const Ledger::Contribution& contribution, Need& need, Instant now) noexcept;

  Duration request_{};
  Duration request_most_{};
  Duration request_idle_{};
  Duration announce_{};
  std::span<Need> needs_;
  std::span<VersionRange> gaps_;  ///< Scratch.
  /// Those in this robot's name, then those that would displace, or are far.
  std::span<Claim> claims_;
  Comparison comparison_{};
  RequestedContribution* requested_ = nullptr;  ///< Scratch: the one that is written.
  std::uint64_t random_ = 0;
};

}  // namespace tessera
