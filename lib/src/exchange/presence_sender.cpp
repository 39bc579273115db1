// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/presence_sender.hpp"

#include <algorithm>
#include <cmath>

#include "tessera/base/rigid.hpp"

namespace tessera {

namespace {

/// Over so long a speed is measured, unless the robot has moved that far before.
constexpr std::int64_t kStep_us = 250'000;
constexpr std::int64_t kShortest_us = 50'000;
constexpr double kStep_m = 0.1;
/// Metres a second: who is slower stands, as places are not exact.
constexpr double kStanding = 0.1;
/// A datagram with a signature, a tag and what LCM puts before it; at most a quarter of the budget.
constexpr std::int64_t kDatagramBytes = 160;
constexpr std::int64_t kShare = 4;

bool can_be_sent(const Presence& presence) noexcept {
  std::array<std::byte, Presence::kBytes> bytes{};
  ByteWriter trial(bytes);
  return write_presence(trial, presence);
}

}  // namespace

Status PresenceSender::set_body(const std::optional<BodyBox>& box) noexcept {
  const bool is_none = box && !Presence::is_sendable(*box);
  body_ = is_none ? std::nullopt : box;
  place_.reset();
  return is_none ? Status::kOutOfRange : Status::kOk;
}

/// Of the corner that moved farthest.
double PresenceSender::moved_m(const Matrix34d& from, const Matrix34d& to) const noexcept {
  double most_m2 = 0.0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    const auto at = [&](std::size_t i) {
      return static_cast<double>((corner >> i & 1U) != 0 ? body_->high[i] : body_->low[i]);
    };
    const Point3d p{at(0), at(1), at(2)};
    most_m2 = std::max(most_m2, squared_norm(apply(to, p) - apply(from, p)));
  }
  return std::sqrt(most_m2);
}

void PresenceSender::note(const Matrix34d& T_global_body, std::int64_t stamp_us,
                          Instant time) noexcept {
  if (!body_) return;
  const Place place{T_global_body, stamp_us, time};
  const bool is_one = can_be_sent({.T_global_body = T_global_body,
                                   .box = *body_,
                                   .stamp_ms = stamp_us < 0 ? -1 : stamp_us / 1000});
  if (!is_one) {
    place_.reset();
    return;
  }
  const std::int64_t step_us = place_ ? stamp_us - before_.stamp_us : 0;
  if (!place_ || step_us <= 0) {
    before_ = place;
    if (!place_) speed_m_per_s_ = 0;
  } else if (const double way_m = moved_m(before_.T_global_body, T_global_body);
             step_us >= kStep_us || way_m > kStep_m) {
    const double speed = way_m / (1e-6 * static_cast<double>(std::max(step_us, kShortest_us)));
    speed_m_per_s_ = speed < kStanding
                         ? std::uint8_t{0}
                         : static_cast<std::uint8_t>(std::ceil(
                               std::min(speed, static_cast<double>(Presence::kMostSpeed_mps))));
    before_ = place;
  }
  place_ = place;
}

Duration PresenceSender::pause() const noexcept {
  const Duration pause = speed_m_per_s_ == 0 ? kStandingPause : kMovingPause;
  const std::int64_t rate = std::max<std::int64_t>(bytes_per_s_, 1);
  return std::max(pause, Duration{kShare * kDatagramBytes * 1'000'000 / rate});
}

bool PresenceSender::is_due(Instant now, bool with_announcement) const noexcept {
  if (!place_ || now - place_->time > kFresh) return false;
  const Duration since = now - sent_;
  return since >= (with_announcement ? pause() / 2 : pause());
}

bool PresenceSender::write(ByteWriter& to, Instant now) noexcept {
  const std::int64_t age_ms = std::max<std::int64_t>((now - place_->time).us, 0) / 1000;
  const bool is_written = write_presence(to, {.T_global_body = place_->T_global_body,
                                              .box = *body_,
                                              .stamp_ms = place_->stamp_us / 1000,
                                              .age_ms = static_cast<std::uint32_t>(age_ms),
                                              .speed_m_per_s = speed_m_per_s_});
  // On time on the whole, where the ticks of send() are not.
  const Instant due = sent_ + pause();
  sent_ = now > due && now - due < pause() / 2 ? due : now;
  return is_written;
}

}  // namespace tessera
