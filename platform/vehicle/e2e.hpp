// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// End-to-end protection of frames by the AUTOSAR E2E protocol: a counter that shows lost, repeated
// or delayed frames, a checksum over the data, and in the checksum an identifier that is not sent,
// which detects a frame under the wrong identifier. Profile 1
// (variant 1A) for CAN 2.0: CRC-8 in byte 0, counter 0 .. 14 in the low half of byte 1. Profile 5
// for CAN FD: CRC-16 in bytes 0 and 1, the low one first, counter 0 .. 255 in byte 2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tessera {

/// CRC-8 with the polynomial of SAE J1850, x^8 + x^4 + x^3 + x^2 + 1, highest bit first. SAE J1850
/// itself starts with 0xff and inverts the result; profile 1 does neither. O(bytes).
[[nodiscard]] std::uint8_t crc8(std::span<const std::uint8_t> bytes, std::uint8_t start) noexcept;
/// CRC-16-CCITT, 0x1021, highest bit first, not inverted; profile 5 starts with 0xffff. O(bytes).
[[nodiscard]] std::uint16_t crc16(std::span<const std::uint8_t> bytes,
                                  std::uint16_t start) noexcept;

enum class E2eProfile : std::uint8_t { kNone, kProfile1, kProfile5 };

/// Bytes of a profile at the front of the data; the high half of profile 1's second byte belongs to
/// the message.
[[nodiscard]] constexpr std::size_t e2e_header_bytes(E2eProfile profile) noexcept {
  return profile == E2eProfile::kProfile1 ? 2 : profile == E2eProfile::kProfile5 ? 3 : 0;
}

/// Sets counter and checksum of data. counter: below 15 for profile 1. data: at least
/// e2e_header_bytes, else nothing happens.
void e2e_protect(E2eProfile profile, std::uint16_t data_id, std::uint8_t counter,
                 std::span<std::uint8_t> data) noexcept;
/// The counter after it.
[[nodiscard]] constexpr std::uint8_t e2e_next(E2eProfile profile, std::uint8_t counter) noexcept {
  const int modulus = profile == E2eProfile::kProfile1 ? 15 : 256;
  return static_cast<std::uint8_t>((counter + 1) % modulus);
}

enum class E2eStatus : std::uint8_t {
  kOk,             ///< The next one.
  kOkSomeLost,     ///< A later one, but within max_delta.
  kInitial,        ///< The first valid one: nothing to compare it with.
  kSync,           ///< In sequence again, but not yet long enough since kWrongSequence.
  kRepeated,       ///< The last one again.
  kWrongSequence,  ///< Beyond max_delta, or an earlier one.
  kWrongCrc,       ///< Damaged, under the wrong identifier, of another length, or counter 15.
};
inline constexpr std::size_t kE2eStatuses = 7;

/// "ok", "some lost", ...
[[nodiscard]] const char* to_string(E2eStatus status) noexcept;

/// True if the data may be used.
[[nodiscard]] constexpr bool is_valid(E2eStatus status) noexcept {
  return status == E2eStatus::kOk || status == E2eStatus::kOkSomeLost;
}

struct E2eConfig {
  E2eProfile profile = E2eProfile::kNone;  ///< kNone: everything of the right size is kOk.
  std::uint16_t data_id = 0;
  std::uint8_t size = 8;
  std::uint8_t max_delta = 4;  ///< Largest valid step of the counter; 1: none lost.
  std::uint8_t sync = 2;       ///< Frames in sequence after a wrong one before kOk.
};

/// Checks the frames of one message as they arrive. The owner's clock must detect missing ones.
class E2eChecker {
 public:
  E2eChecker() = default;
  explicit E2eChecker(const E2eConfig& config) noexcept : config_(config) {}

  /// O(bytes).
  [[nodiscard]] E2eStatus check(std::span<const std::uint8_t> data) noexcept;
  /// Resets it, as if nothing had been received: the next valid frame is kInitial.
  void forget() noexcept {
    known_ = false;
    unsure_ = 0;
  }

 private:
  E2eConfig config_{};
  bool known_ = false;
  std::uint8_t last_ = 0;
  std::uint8_t unsure_ = 0;  ///< Frames in sequence that are missing until kOk.
};

}  // namespace tessera
