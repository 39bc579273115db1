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
  kFormat,    ///< Dropped: none of what is sent on this channel.
  kTag,       ///< Dropped: damaged, or of none who has the key.
  kExcluded,  ///< Dropped: of a sender that is not to be heard.
};

/// Judges a payload before it takes a place in the queue. check is called in the thread that
/// receives, with context, which must outlive the link; it must neither wait nor use the heap.
struct PayloadCheck {
  void* context = nullptr;
  /// nullptr: every payload is taken.
  PayloadVerdict (*check)(void* context, std::span<const std::byte> payload) noexcept = nullptr;
};

}  // namespace tessera
