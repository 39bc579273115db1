// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Tags by the fleet's key: who does not have it can neither make nor change a datagram. Who has it
// can speak for any robot; FleetSignatures is against that.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "posix/outcome.hpp"
#include "security/key_file.hpp"
#include "security/mission.hpp"
#include "tessera/exchange/authenticator.hpp"

namespace tessera {

/// What a key derived from the fleet's is for. Each use has a context of its own in the derivation,
/// so that no tag is worth anything elsewhere.
enum class KeyUse : std::uint8_t {
  kDatagram = 0,  ///< A whole datagram, on its way from its sender.
  kStatus = 1,    ///< A message on the channel TESSERA_STATUS.
};

/// Keyed BLAKE2b, 128 bits. No heap; a tag takes O(message).
class DatagramSeal {
 public:
  /// Derives the key of that mission and use: BLAKE2b of 32 bytes, keyed by the fleet's key, over
  /// the use's context, the length of the mission's name in one byte, and the name
  /// (docs/wire-format.md). Fails with kFailure iff libsodium does not start.
  static Outcome<DatagramSeal> make(const SecretKey& fleet_key, const Mission& mission, KeyUse use);

  void tag(std::span<const std::byte> message, std::span<std::byte, kTagBytes> tag) const noexcept;
  /// The comparison takes the same time wherever the tags differ.
  [[nodiscard]] bool check(std::span<const std::byte> message,
                           std::span<const std::byte, kTagBytes> tag) const noexcept;
  /// For the exchange. This seal must outlive it and stay where it is.
  [[nodiscard]] Authenticator authenticator() noexcept;

 private:
  DatagramSeal() = default;
  SecretKey key_;
};

}  // namespace tessera
