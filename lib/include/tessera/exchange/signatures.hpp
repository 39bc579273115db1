// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How the exchange signs what this robot says and checks what others have said, without knowing any
// cryptography: three functions that the program gives it. With them no robot can speak for
// another.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tessera {

inline constexpr std::size_t kSignatureBytes = 64;
inline constexpr std::size_t kHashBytes = 16;

using Signature = std::array<std::byte, kSignatureBytes>;
using Hash = std::array<std::byte, kHashBytes>;

/// All are called with context, from the exchange's thread only, and return in a time that
/// depends only on the message's length. context must outlive whoever holds this.
struct Signatures {
  void* context = nullptr;
  /// This robot's signature of the message.
  void (*sign)(void* context, std::span<const std::byte> message,
               std::span<std::byte, kSignatureBytes> signature) noexcept = nullptr;
  /// True iff that robot signed the message.
  bool (*check)(void* context, std::uint32_t robot, std::span<const std::byte> message,
                std::span<const std::byte, kSignatureBytes> signature) noexcept = nullptr;
  /// A hash for which nobody finds a second message; the same for the whole fleet.
  void (*hash)(void* context, std::span<const std::byte> message,
               std::span<std::byte, kHashBytes> hash) noexcept = nullptr;
  [[nodiscard]] bool on() const noexcept { return sign != nullptr; }
};

}  // namespace tessera
