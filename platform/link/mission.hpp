// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The name of a mission. Keys of tags and signed messages contain it, so that recordings of one
// mission are invalid in another one of the same fleet with the same keys.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/outcome.hpp"

namespace tessera {

class Mission {
 public:
  static constexpr std::size_t kMostNameBytes = 64;
  static constexpr std::size_t kValueBytes = 16;
  using Value = std::array<std::byte, kValueBytes>;

  /// No mission, for a fleet without keys. Its name is empty, its value and number are 0.
  Mission() noexcept = default;
  /// name: 1 to 64 bytes without control characters, and no space first or last. The same bytes on
  /// all robots. Fails with kUsage iff it is invalid, kFailure iff libsodium does not start.
  static Outcome<Mission> make(std::string_view name);
  /// "mission-" and ten random hex digits. Fails with kFailure iff libsodium does not start.
  static Outcome<Mission> make_random();

  [[nodiscard]] std::string_view name() const noexcept { return {name_.data(), name_bytes_}; }
  /// BLAKE2b of 16 bytes over "tessera 2 mission", the length of the name in one byte, and the
  /// name. Each message that is signed or checked begins with it.
  [[nodiscard]] const Value& value() const noexcept { return value_; }
  /// The first four bytes of value(), little-endian: the mission in datagrams.
  [[nodiscard]] std::uint32_t number() const noexcept;

 private:
  std::array<char, kMostNameBytes> name_{};
  std::size_t name_bytes_ = 0;
  Value value_{};
};

/// Enough for a context of 47 bytes, a length and the longest name.
inline constexpr std::size_t kMostMissionInputBytes = 48 + Mission::kMostNameBytes;

/// Writes context, the length of the mission's name in one byte, and the name into `into`. context:
/// at most 47 bytes. Returns the number of bytes. Keys and values are derived from this.
std::size_t write_mission_input(std::string_view context, const Mission& mission,
                                std::array<unsigned char, kMostMissionInputBytes>& into) noexcept;

}  // namespace tessera
