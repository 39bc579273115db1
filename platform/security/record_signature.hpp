// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Ed25519 signatures: each robot signs its own records by a key that nobody else has, so that no
// robot can speak for another, and who passes a record on passes its signature on as it is.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "posix/outcome.hpp"
#include "security/key_file.hpp"
#include "tessera/exchange/signatures.hpp"

namespace tessera {

/// A robot's own key. No heap after make().
class RecordSigner {
 public:
  /// Fails with kFailure iff libsodium does not start.
  static Outcome<RecordSigner> make(const RobotSecret& secret);
  RecordSigner(RecordSigner&& other) noexcept;
  RecordSigner& operator=(RecordSigner&&) = delete;
  RecordSigner(const RecordSigner&) = delete;
  RecordSigner& operator=(const RecordSigner&) = delete;
  ~RecordSigner();

  [[nodiscard]] std::uint32_t robot() const noexcept { return robot_; }
  /// The same record gives the same signature.
  void sign(std::span<const std::byte> record,
            std::span<std::byte, kSignatureBytes> signature) const noexcept;

 private:
  static constexpr std::size_t kExpandedBytes = 64;
  RecordSigner() = default;
  std::uint32_t robot_ = 0;
  std::array<unsigned char, kExpandedBytes> key_{};
};

/// The public keys of the fleet. No heap after make().
class RecordVerifier {
 public:
  /// keys: as read_public_keys() gives them, in the order of the robots. Fails with kFailure iff
  /// libsodium does not start.
  static Outcome<RecordVerifier> make(std::vector<RobotPublic> keys);

  [[nodiscard]] bool knows(std::uint32_t robot) const noexcept { return find(robot) != nullptr; }
  /// True iff robot is known and signed this record. O(log robots) and O(record).
  [[nodiscard]] bool check(std::uint32_t robot, std::span<const std::byte> record,
                           std::span<const std::byte, kSignatureBytes> signature) const noexcept;

 private:
  explicit RecordVerifier(std::vector<RobotPublic> keys) noexcept : keys_(std::move(keys)) {}
  [[nodiscard]] const RobotPublic* find(std::uint32_t robot) const noexcept;
  std::vector<RobotPublic> keys_;
};

}  // namespace tessera
