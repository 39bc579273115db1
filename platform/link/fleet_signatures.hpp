// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The key of a robot and the public keys of its fleet, as functions for the exchange.
#pragma once

#include <string>

#include "link/record_signature.hpp"

namespace tessera {

class FleetSignatures {
 public:
  /// Fails with kUsage iff verifier does not have the signer's robot with its key, or is of another
  /// mission.
  static Outcome<FleetSignatures> make(RecordSigner signer, RecordVerifier verifier);
  /// Reads files for read_robot_secret() and read_public_keys(). Fails as they do, and as make().
  static Outcome<FleetSignatures> read(const std::string& robot_secret,
                                       const std::string& public_keys, const Mission& mission);
  [[nodiscard]] std::uint32_t robot() const noexcept { return signer_.robot(); }
  /// Swaps the public keys of the two; for the thread that uses this one's signatures().
  void swap_public_keys(FleetSignatures& other) noexcept { verifier_.swap_keys(other.verifier_); }
  /// For the exchange: Ed25519, and BLAKE2b of 128 bits as the hash. This must outlive it, at the
  /// same address.
  [[nodiscard]] Signatures signatures() noexcept;

 private:
  FleetSignatures(RecordSigner signer, RecordVerifier verifier) noexcept
      : signer_(std::move(signer)), verifier_(std::move(verifier)) {}
  RecordSigner signer_;
  RecordVerifier verifier_;
};

}  // namespace tessera
