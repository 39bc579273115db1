// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How the exchange reaches replicas: these alone, or those of a global map that follows them.
#pragma once

#include "tessera/replica/objection.hpp"

namespace tessera {

/// Where replicas are kept: Replicas itself, or a global map around them.
struct ReplicaStore {
  void* context = nullptr;
  const Replicas* replicas = nullptr;
  /// As GlobalMap::open, put, set_frame and remove.
  Result<Replicas::Slot> (*open)(void* context, const ContributionId& id,
                                 const GridTransform& T_global_local) noexcept = nullptr;
  Result<Replicas::Change> (*put)(void* context, Replicas::Slot slot, BlockKey key,
                                  const PartVersion& version, std::span<const std::byte> packed,
                                  std::span<const std::byte> wire) noexcept = nullptr;
  void (*set_frame)(void* context, Replicas::Slot slot, const GridTransform& T_global_local,
                    std::uint32_t revision, const MapSession& session) noexcept = nullptr;
  void (*remove)(void* context, Replicas::Slot slot) noexcept = nullptr;
  /// Of the storage that is fullest, how much is in use, in 1024 of it.
  std::uint32_t (*fullness)(const void* context) noexcept = nullptr;
};

/// Replicas alone, for robots that only pass on what they hear. Removing takes O(parts).
[[nodiscard]] ReplicaStore store_of(Replicas& replicas) noexcept;

}  // namespace tessera
