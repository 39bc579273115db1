// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What stands behind the typed message of a status, and protects it: session, sequence, signature
// and tag (docs/wire-format.md). LCM's own tools read the typed message and ignore the rest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "lcm/payload_check.hpp"
#include "tessera/exchange/authenticator.hpp"
#include "tessera/exchange/signatures.hpp"

namespace tessera {

inline constexpr const char* kStatusChannel = "TESSERA_STATUS";
/// Of the typed message.
inline constexpr std::size_t kTypedStatusBytes = 320;
/// Of a status with session, sequence, signature and tag.
inline constexpr std::size_t kMostStatusBytes =
    kTypedStatusBytes + 12 + kSignatureBytes + kTagBytes;

/// What the fleet's statuses carry. All robots of a fleet have the same of them.
struct StatusKeys {
  /// Of KeyUse::kStatus; without functions: the fleet has no key, and there is no tag.
  Authenticator authenticator{};
  Signatures signatures{};
  [[nodiscard]] bool has_tag() const noexcept { return authenticator.check != nullptr; }
  [[nodiscard]] std::size_t status_bytes() const noexcept {
    return kTypedStatusBytes + 12 + (signatures.on() ? kSignatureBytes : 0) +
           (has_tag() ? kTagBytes : 0);
  }
};

/// What others do with a status.
struct HeardStatus {
  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;
  std::uint64_t session = 0;
  std::uint32_t sequence = 0;
  std::uint32_t exclude_digest = 0;
  std::uint64_t own_twins = 0;    ///< What it heard of another process that speaks as itself.
  std::uint64_t other_twins = 0;  ///< And of other robots' numbers that two processes use.
};

/// Writes what follows the typed message into `status`, whose first kTypedStatusBytes are it.
/// status: of keys.status_bytes(). No heap.
void seal_status(std::span<std::byte> status, std::uint64_t session, std::uint32_t sequence,
                 const StatusKeys& keys) noexcept;

/// kTaken, kFormat or kTag: what can be said without a signature. The tag is looked at only where
/// size and kind are right. No heap; for any number of threads.
[[nodiscard]] PayloadVerdict judge_status(std::span<const std::byte> status,
                                          const StatusKeys& keys) noexcept;
/// Of a status that judge_status() takes.
[[nodiscard]] HeardStatus read_status(std::span<const std::byte> status) noexcept;
/// Whether the robot that a status names signed it; true where the fleet does not sign. status: one
/// that judge_status() takes.
[[nodiscard]] bool check_status_signature(std::span<const std::byte> status,
                                          const StatusKeys& keys) noexcept;

}  // namespace tessera
