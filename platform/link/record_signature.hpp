// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Ed25519 signatures: each robot signs its own records with a key that only it has, so that no
// robot can forge records of another; relays pass signatures on unchanged. The signed bytes are the
// mission's value and the message, so that signatures of another mission are invalid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/outcome.hpp"
#include "link/key_file.hpp"
#include "link/mission.hpp"
#include "tessera/exchange/signatures.hpp"

namespace tessera {

/// Most bytes of a signed message. Datagrams are shorter.
inline constexpr std::size_t kMostSignedBytes = 2048;

/// A robot's own key. No heap after make().
class RecordSigner {
 public:
  /// Fails with kFailure iff libsodium does not start.
  static Outcome<RecordSigner> make(const RobotSecret& secret, const Mission& mission);
  RecordSigner(RecordSigner&& other) noexcept;
  RecordSigner& operator=(RecordSigner&&) = delete;
  RecordSigner(const RecordSigner&) = delete;
  RecordSigner& operator=(const RecordSigner&) = delete;
  ~RecordSigner();

  [[nodiscard]] std::uint32_t robot() const noexcept { return robot_; }
  /// The same record gives the same signature. record: at most kMostSignedBytes; for a longer one,
  /// which is a caller bug, all bytes of the signature are 0, and no verifier accepts it.
  void sign(std::span<const std::byte> record,
            std::span<std::byte, kSignatureBytes> signature) const noexcept;

 private:
  static constexpr std::size_t kExpandedBytes = 64;
  RecordSigner() = default;
  std::uint32_t robot_ = 0;
  Mission::Value mission_{};
  std::array<unsigned char, kExpandedBytes> key_{};
};

/// The public keys of the fleet. No heap after make().
class RecordVerifier {
 public:
  /// keys: as returned by read_public_keys(), in the order of the robots. Fails with kFailure iff
  /// libsodium does not start.
  static Outcome<RecordVerifier> make(std::vector<RobotPublic> keys, const Mission& mission);

  /// Swaps the keys of the two.
  void swap_keys(RecordVerifier& other) noexcept { keys_.swap(other.keys_); }
  [[nodiscard]] bool knows(std::uint32_t robot) const noexcept { return find(robot) != nullptr; }
  /// True iff robot is known and signed this record in this mission; false for a record of over
  /// kMostSignedBytes. O(log robots) and O(record).
  [[nodiscard]] bool check(std::uint32_t robot, std::span<const std::byte> record,
                           std::span<const std::byte, kSignatureBytes> signature) const noexcept;

 private:
  RecordVerifier(std::vector<RobotPublic> keys, const Mission& mission) noexcept
      : mission_(mission.value()), keys_(std::move(keys)) {}
  [[nodiscard]] const RobotPublic* find(std::uint32_t robot) const noexcept;
  Mission::Value mission_;
  std::vector<RobotPublic> keys_;
};

}  // namespace tessera
