// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/fleet_signatures.hpp"

#include <fmt/core.h>
#include <sodium.h>

#include <string>

namespace tessera {

static_assert(kHashBytes >= crypto_generichash_BYTES_MIN);

Outcome<FleetSignatures> FleetSignatures::make(RecordSigner signer, RecordVerifier verifier) {
  Signature signature;
  signer.sign({}, signature);
  if (!verifier.check(signer.robot(), {}, signature)) {
    return Failure{
        fmt::format(
            "robot {} is not among the public keys, or has another key there than its secret",
            signer.robot()),
        FailureKind::kUsage};
  }
  return FleetSignatures(std::move(signer), std::move(verifier));
}

Outcome<FleetSignatures> FleetSignatures::read(const std::string& robot_secret,
                                               const std::string& public_keys,
                                               const Mission& mission) {
  TESSERA_TRY_ASSIGN(const RobotSecret secret, read_robot_secret(robot_secret));
  TESSERA_TRY_ASSIGN(std::vector<RobotPublic> keys, read_public_keys(public_keys));
  TESSERA_TRY_ASSIGN(RecordSigner signer, RecordSigner::make(secret, mission));
  TESSERA_TRY_ASSIGN(RecordVerifier verifier, RecordVerifier::make(std::move(keys), mission));
  Outcome<FleetSignatures> fleet = make(std::move(signer), std::move(verifier));
  if (fleet.ok()) return fleet;
  return Failure{fleet.failure().message + ": add the line of its .pub file to " + public_keys +
                     ", or name another file than " + robot_secret,
                 fleet.failure().kind};
}

Signatures FleetSignatures::signatures() noexcept {
  return {.context = this,
          .sign =
              [](void* self, std::span<const std::byte> message,
                 std::span<std::byte, kSignatureBytes> signature) noexcept {
                static_cast<const FleetSignatures*>(self)->signer_.sign(message, signature);
              },
          .check =
              [](void* self, std::uint32_t robot, std::span<const std::byte> message,
                 std::span<const std::byte, kSignatureBytes> signature) noexcept {
                return static_cast<const FleetSignatures*>(self)->verifier_.check(robot, message,
                                                                                  signature);
              },
          .hash =
              [](void* /*self*/, std::span<const std::byte> message,
                 std::span<std::byte, kHashBytes> hash) noexcept {
                // Fails only for lengths out of its range, and this one is a constant.
                ::crypto_generichash(reinterpret_cast<unsigned char*>(hash.data()), hash.size(),
                                     reinterpret_cast<const unsigned char*>(message.data()),
                                     message.size(), nullptr, 0);
              }};
}

}  // namespace tessera
