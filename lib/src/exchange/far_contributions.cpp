// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/far_contributions.hpp"

#include "tessera/base/internal/digest.hpp"

namespace tessera {

Result<FarContributions> FarContributions::make(Arena& arena, std::uint32_t places,
                                                std::uint64_t hash_seed) noexcept {
  FarContributions made;
  if (places == 0) return made;
  made.salt_ = mix64(hash_seed ^ 0x6661722d636f6e74U);
  made.places_ = arena.take<FarContribution>(places);
  made.free_ = arena.take<std::uint32_t>(places);
  const Result<KeyIndex> index = KeyIndex::make(arena, places, hash_seed);
  if (made.places_.empty() || made.free_.empty() || !index.ok()) return Status::kResourceExhausted;
  made.index_ = *index;
  // So that the first places are taken first.
  for (std::uint32_t i = 0; i < places; ++i) made.free_[i] = places - 1 - i;
  return made;
}

/// Of two names with one key the second finds no place: without the salt nobody can make such.
BlockKey FarContributions::key_of(const ContributionId& id) const noexcept {
  const std::uint64_t name = mix64((std::uint64_t{id.robot} << 32U | id.epoch) ^ salt_);
  return {mix64(name + id.submap) >> 1U};
}

FarContribution* FarContributions::find(const ContributionId& id) noexcept {
  const std::optional<std::uint32_t> place = index_.find(key_of(id));
  return place && places_[*place].id() == id ? &places_[*place] : nullptr;
}

FarContribution* FarContributions::add(const ContributionId& id) noexcept {
  const BlockKey key = key_of(id);
  if (!has_room() || index_.find(key)) return nullptr;
  const std::uint32_t place = free_[places_.size() - size_ - 1];
  if (index_.insert(key, place) != Status::kOk) return nullptr;
  ++size_;
  FarContribution& one = places_[place];
  one = {};
  one.used = true;
  one.statement.id = id;
  return &one;
}

void FarContributions::remove(FarContribution& one) noexcept {
  TESSERA_ASSERT(one.used);
  static_cast<void>(index_.erase(key_of(one.id())));
  one.used = false;
  --size_;
  free_[places_.size() - size_ - 1] = static_cast<std::uint32_t>(&one - places_.data());
}

}  // namespace tessera
