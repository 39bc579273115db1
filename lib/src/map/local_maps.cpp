// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/local_maps.hpp"

#include <algorithm>

#include "tessera/base/assert.hpp"

namespace tessera {

Status LocalMaps::set_up(Arena& arena, const MapConfig& config, const ClassTable& classes,
                         bool in_submaps, std::uint32_t first) noexcept {
  in_submaps_ = in_submaps;
  number_.store(first, std::memory_order_relaxed);
  frame_since_.store(first, std::memory_order_relaxed);
  for (std::atomic<std::uint32_t>& at : at_) at.store(first, std::memory_order_relaxed);
  for (std::size_t i = 0; i < (in_submaps ? 2U : 1U); ++i) {
    const Status status = LocalMap::make_at(maps_[i], arena, config, classes);
    if (status != Status::kOk) return status;
  }
  return Status::kOk;
}

const LocalMap* LocalMaps::before() const noexcept {
  const std::uint32_t at = number();
  return in_submaps_ && frame_since_.load(std::memory_order_relaxed) != at ? &of(at - 1) : nullptr;
}

std::optional<std::uint32_t> LocalMaps::ended(User user) const noexcept {
  const std::uint32_t at = at_[place_of(user)].load(std::memory_order_relaxed);
  return number() != at ? std::optional(at) : std::nullopt;
}

void LocalMaps::note_done(User user) noexcept {
  TESSERA_ASSERT(ended(user).has_value());
  at_[place_of(user)].fetch_add(1, std::memory_order_release);
}

bool LocalMaps::may_begin() const noexcept {
  if (!in_submaps_) return false;
  const std::uint32_t number = number_.load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < kUsers; ++i) {
    if (required_[i] && at_[i].load(std::memory_order_acquire) != number) return false;
  }
  return true;
}

void LocalMaps::begin(bool continues, const SubmapNote& ended) noexcept {
  TESSERA_ASSERT(may_begin());
  const std::uint32_t next = number_.load(std::memory_order_relaxed) + 1;
  notes_[(next - 1) % 2] = ended;
  maps_[next % 2].clear();
  if (!continues) frame_since_.store(next, std::memory_order_relaxed);
  number_.store(next, std::memory_order_release);
}

}  // namespace tessera
