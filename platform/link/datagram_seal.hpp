// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Tags by the fleet's key: without it nobody can make or change a datagram. With it data of any
// robot can be forged; FleetSignatures prevents that.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/outcome.hpp"
#include "link/key_file.hpp"
#include "link/mission.hpp"
#include "tessera/exchange/authenticator.hpp"

namespace tessera {

/// Uses of keys that are derived from the fleet's key. Each use has its own context in the
/// derivation, so that a tag is valid for one use only.
enum class KeyUse : std::uint8_t {
  kDatagram = 0,  ///< A whole datagram, from its sender.
  kStatus = 1,    ///< A message on the channel TESSERA_STATUS.
};

/// Keyed BLAKE2b, 128 bits. No heap; a tag takes O(message).
class DatagramSeal {
 public:
  /// Derives the key for a mission and use: BLAKE2b of 32 bytes, keyed by the fleet's key, over
  /// the use's context, the length of the mission's name in one byte, and the name
  /// (docs/reference/wire-format.md). Fails with kFailure iff libsodium does not start.
  static Outcome<DatagramSeal> make(const SecretKey& fleet_key, const Mission& mission, KeyUse use);

  void tag(std::span<const std::byte> message, std::span<std::byte, kTagBytes> tag) const noexcept;
  /// The comparison takes constant time.
  [[nodiscard]] bool check(std::span<const std::byte> message,
                           std::span<const std::byte, kTagBytes> tag) const noexcept;
  /// For the exchange, which this seal must outlive, at the same address.
  [[nodiscard]] Authenticator authenticator() noexcept;

 private:
  DatagramSeal() = default;
  SecretKey key_;
};

}  // namespace tessera
