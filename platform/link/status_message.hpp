// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What follows the typed message of a status and protects it: session, sequence, signature and tag
// (docs/reference/wire-format.md). Tools of LCM read the typed message and ignore the rest.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "link/payload_check.hpp"
#include "tessera/exchange/authenticator.hpp"
#include "tessera/exchange/signatures.hpp"

namespace tessera {

inline constexpr const char* kStatusChannel = "TESSERA_STATUS";
/// Size of the typed message.
inline constexpr std::size_t kTypedStatusBytes = 436;
/// Size of a status with session, sequence, signature and tag.
inline constexpr std::size_t kMostStatusBytes =
    kTypedStatusBytes + 12 + kSignatureBytes + kTagBytes;

/// Protection of the fleet's statuses, the same for all robots of a fleet.
struct StatusKeys {
  /// For KeyUse::kStatus; without functions: the fleet has no key, and there is no tag.
  Authenticator authenticator{};
  Signatures signatures{};
  [[nodiscard]] bool has_tag() const noexcept { return authenticator.check != nullptr; }
  [[nodiscard]] std::size_t status_bytes() const noexcept {
    return kTypedStatusBytes + 12 + (signatures.on() ? kSignatureBytes : 0) +
           (has_tag() ? kTagBytes : 0);
  }
};

/// Results of checking a status.
struct HeardState {
  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;
  std::uint64_t session = 0;
  std::uint32_t sequence = 0;
  std::uint32_t exclude_digest = 0;
  std::uint64_t own_twins = 0;  ///< Times that it heard another process with its number.
  std::uint64_t other_twins =
      0;                        ///< Times that it heard two processes with another robot's number.
  std::uint64_t conflicts = 0;  ///< Versions for which it heard two signed contents.
};

/// Writes what follows the typed message into `status`, whose first kTypedStatusBytes are that
/// message. status: of keys.status_bytes(). No heap.
void seal_status(std::span<std::byte> status, std::uint64_t session, std::uint32_t sequence,
                 const StatusKeys& keys) noexcept;

/// kTaken, kFormat or kTag: the checks without the signature. Checks the tag only if size and kind
/// are right. No heap; for any number of threads.
[[nodiscard]] PayloadVerdict judge_status(std::span<const std::byte> status,
                                          const StatusKeys& keys) noexcept;
/// For a status that judge_status() accepts.
[[nodiscard]] HeardState read_status(std::span<const std::byte> status) noexcept;
/// True if the robot in a status has signed it, or if the fleet does not sign. status: accepted by
/// judge_status().
[[nodiscard]] bool check_status_signature(std::span<const std::byte> status,
                                          const StatusKeys& keys) noexcept;

}  // namespace tessera
