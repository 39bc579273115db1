// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/status_publisher.hpp"

#include <algorithm>
#include <iterator>
#include <tessera_status.hpp>

namespace tessera {
namespace {

/// LCM has no unsigned numbers; readers use the bits.
std::int64_t signed_bits(std::uint64_t value) { return static_cast<std::int64_t>(value); }

std::int64_t per_second(std::uint64_t now, std::uint64_t before, std::int64_t duration_us) {
  if (duration_us <= 0) return 0;
  return static_cast<std::int64_t>(static_cast<double>(now - before) * 1e6 /
                                   static_cast<double>(duration_us));
}

void fill_doubted(tessera_status& message, const NodeState& status) {
  static_assert(std::tuple_size_v<decltype(status.first_doubted)> == tessera_status::DOUBTED);
  message.doubted = static_cast<std::int32_t>(status.doubted);
  for (std::size_t i = 0; i < std::min<std::size_t>(status.doubted, tessera_status::DOUBTED); ++i) {
    message.doubted_robot[i] = static_cast<std::int32_t>(status.first_doubted[i].robot);
    message.doubted_classes[i] = signed_bits(status.first_doubted[i].classes);
  }
}

void fill_counters(tessera_status& message, const LinkReport& s, const NodeState& status) {
  static_assert(kLinkCounters + std::tuple_size_v<decltype(status.extra)> ==
                tessera_status::COUNTERS);
  std::int64_t* const rest =
      std::transform(kCounters<LinkReport>.begin(), kCounters<LinkReport>.end(), message.counters,
                     [&s](const Counter<LinkReport>& row) { return row.value(s); });
  std::copy(status.extra.begin(), status.extra.end(), rest);
}

}  // namespace

bool StatusPublisher::publish(const NodeState& status, std::int64_t now_us) noexcept {
  const LinkReport now = link_->report();
  if (last_us_ == kNever) start_us_ = last_us_ = now_us;
  const std::int64_t duration_us = now_us - last_us_;
  tessera_status message{};
  message.version = kStatusVersion;
  message.robot = static_cast<std::int32_t>(status.robot);
  message.epoch = static_cast<std::int32_t>(status.epoch);
  message.peers = static_cast<std::int32_t>(status.peers);
  message.stamp_us = status.stamp_us;
  message.uptime_us = now_us - start_us_;
  message.tick_median_us = status.tick_median_us;
  message.tick_max_us = status.tick_max_us;
  message.label_voxels = status.label_voxels;
  message.free_voxels = status.free_voxels;
  message.sent_bytes_per_s = per_second(now.sent_bytes, last_.sent_bytes, duration_us);
  message.received_bytes_per_s = per_second(now.received_bytes, last_.received_bytes, duration_us);
  message.digest = signed_bits(status.digest);
  message.exclude_digest = status.exclude_digest;
  fill_doubted(message, status);
  fill_counters(message, now, status);
  last_ = now;
  last_us_ = now_us;
  const auto status_bytes = std::span(buffer_).first(keys_.status_bytes());
  const int typed = message.encode(buffer_.data(), 0, static_cast<int>(kTypedStatusBytes));
  // The first cannot happen: the typed message has a fixed size.
  if (typed != static_cast<int>(kTypedStatusBytes) || sequence_ == UINT32_MAX) return false;
  seal_status(status_bytes, status.session, ++sequence_, keys_);
  return link_->send_on(kStatusChannel, status_bytes);
}

}  // namespace tessera
