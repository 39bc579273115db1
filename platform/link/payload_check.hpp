// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tessera {

/// What a link does with a payload on its channel.
enum class PayloadVerdict : std::uint8_t {
  kTaken,
  kFormat,    ///< Dropped: not of this channel's format.
  kMission,   ///< Dropped: of another mission.
  kTag,       ///< Dropped: damaged, or from a sender without the key.
  kExcluded,  ///< Dropped: of an excluded sender.
};

/// Judges a payload before it takes a place in the queue. check is called in the thread that
/// receives, with context, which must outlive the link; it must neither wait nor use the heap.
struct PayloadCheck {
  void* context = nullptr;
  /// nullptr: every payload is taken.
  PayloadVerdict (*check)(void* context, std::span<const std::byte> payload) noexcept = nullptr;
};

}  // namespace tessera
