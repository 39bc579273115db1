// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// When a robot says where it is: often while it moves, now and then while it stands, and not at all
// once it does not know.
#pragma once

#include <optional>

#include "tessera/base/instant.hpp"
#include "tessera/exchange/exchange_config.hpp"
#include "tessera/exchange/presence.hpp"

namespace tessera {

class PresenceSender {
 public:
  static constexpr Duration kMovingPause{100'000};
  static constexpr Duration kStandingPause{1'000'000};
  /// A place is sent for so long after it was noted.
  static constexpr Duration kFresh{1'000'000};

  explicit PresenceSender(const ExchangeConfig& config) noexcept
      : bytes_per_s_(config.bytes_per_s) {}
  PresenceSender() noexcept = default;

  /// Nothing: it says nothing, as at first. Fails with kOutOfRange iff it cannot be sent
  /// (Presence::is_sendable), and then it says nothing.
  [[nodiscard]] Status set_body(const std::optional<BodyBox>& box) noexcept;
  [[nodiscard]] const std::optional<BodyBox>& body() const noexcept { return body_; }
  /// Where the robot was at a time on the clock of send(). stamp_us: the same on the clock of the
  /// robot's poses. A place that cannot be sent counts as none. O(1).
  void note(const Matrix34d& T_global_body, std::int64_t stamp_us, Instant time) noexcept;
  /// Nothing is sent until another place is noted.
  void forget_place() noexcept { place_.reset(); }
  /// The place is due, alone or with an announcement, which it then goes with. O(1).
  [[nodiscard]] bool is_due(Instant now, bool with_announcement) const noexcept;
  /// Writes it. False: it does not fit.
  [[nodiscard]] bool write(ByteWriter& to, Instant now) noexcept;

 private:
  struct Place {
    Matrix34d T_global_body = Matrix34d::Identity();
    std::int64_t stamp_us = 0;
    Instant time;
  };
  [[nodiscard]] double moved_m(const Matrix34d& from, const Matrix34d& to) const noexcept;
  [[nodiscard]] Duration pause() const noexcept;

  std::uint32_t bytes_per_s_ = 0;
  std::optional<BodyBox> body_;
  std::optional<Place> place_;
  Place before_{};  ///< That the speed is measured from.
  std::uint8_t speed_m_per_s_ = 0;
  Instant sent_;
};

}  // namespace tessera
