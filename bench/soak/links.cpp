// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "soak/links.hpp"

#include <utility>

namespace tessera::soak {

Links::Links(int robots, const BurstLoss& loss)
    : robots_(robots),
      loss_(loss),
      groups_(static_cast<std::size_t>(robots), 0),
      bursts_(static_cast<std::size_t>(robots) * static_cast<std::size_t>(robots), false),
      on_their_way_(static_cast<std::size_t>(robots)) {}

/// In a burst all is lost. One ends with each datagram by the inverse of its length, and begins so
/// often that the shares are as asked for.
bool Links::is_lost(int from, int to) {
  const auto at = static_cast<std::size_t>(from * robots_ + to);
  const double ends = 1.0 / loss_.burst;
  const double begins = ends * loss_.share / (1.0 - loss_.share);
  bursts_[at] = bursts_[at] ? !random_.chance(ends) : random_.chance(begins);
  return bursts_[at];
}

void Links::send(int from, Bytes bytes, std::int64_t now_us) {
  ++sent_;
  sent_bytes_ += bytes.size();
  const auto shared = std::make_shared<const Bytes>(std::move(bytes));
  for (int to = 0; to < robots_; ++to) {
    const bool hears = to != from && groups_[static_cast<std::size_t>(from)] ==
                                         groups_[static_cast<std::size_t>(to)];
    if (!hears) continue;
    ++tried_;
    if (is_lost(from, to)) {
      ++lost_;
      continue;
    }
    const auto delay_us = static_cast<std::int64_t>(random_.uniform(
        static_cast<double>(loss_.least_delay_us), static_cast<double>(loss_.most_delay_us)));
    on_their_way_[static_cast<std::size_t>(to)].push({now_us + delay_us, order_++, shared});
  }
}

std::shared_ptr<const Links::Bytes> Links::receive(int to, std::int64_t now_us) {
  std::priority_queue<Arrival>& arrivals = on_their_way_[static_cast<std::size_t>(to)];
  if (arrivals.empty() || arrivals.top().at_us > now_us) return nullptr;
  std::shared_ptr<const Bytes> bytes = arrivals.top().bytes;
  arrivals.pop();
  return bytes;
}

void Links::drop_for(int to) { on_their_way_[static_cast<std::size_t>(to)] = {}; }

}  // namespace tessera::soak
