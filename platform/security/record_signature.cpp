// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "security/record_signature.hpp"

#include <sodium.h>

#include <algorithm>

namespace tessera {
namespace {

static_assert(kSignatureBytes == crypto_sign_BYTES);
static_assert(kKeyBytes == crypto_sign_SEEDBYTES && kKeyBytes == crypto_sign_PUBLICKEYBYTES);

const unsigned char* octets(std::span<const std::byte> bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

}  // namespace

Outcome<RecordSigner> RecordSigner::make(const RobotSecret& secret) {
  static_assert(kExpandedBytes == crypto_sign_SECRETKEYBYTES);
  if (::sodium_init() < 0) return Failure{"libsodium does not start", FailureKind::kFailure};
  RecordSigner signer;
  signer.robot_ = secret.robot;
  std::array<unsigned char, kKeyBytes> open{};
  ::crypto_sign_seed_keypair(open.data(), signer.key_.data(), secret.seed.bytes().data());
  return signer;
}

RecordSigner::RecordSigner(RecordSigner&& other) noexcept : robot_(other.robot_), key_(other.key_) {
  ::sodium_memzero(other.key_.data(), other.key_.size());
}

RecordSigner::~RecordSigner() { ::sodium_memzero(key_.data(), key_.size()); }

void RecordSigner::sign(std::span<const std::byte> record,
                        std::span<std::byte, kSignatureBytes> signature) const noexcept {
  ::crypto_sign_detached(reinterpret_cast<unsigned char*>(signature.data()), nullptr,
                         octets(record), record.size(), key_.data());
}

Outcome<RecordVerifier> RecordVerifier::make(std::vector<RobotPublic> keys) {
  if (::sodium_init() < 0) return Failure{"libsodium does not start", FailureKind::kFailure};
  return RecordVerifier(std::move(keys));
}

const RobotPublic* RecordVerifier::find(std::uint32_t robot) const noexcept {
  const auto found =
      std::lower_bound(keys_.begin(), keys_.end(), robot,
                       [](const RobotPublic& key, std::uint32_t id) { return key.robot < id; });
  return found != keys_.end() && found->robot == robot ? &*found : nullptr;
}

bool RecordVerifier::check(std::uint32_t robot, std::span<const std::byte> record,
                           std::span<const std::byte, kSignatureBytes> signature) const noexcept {
  const RobotPublic* const key = find(robot);
  return key != nullptr && ::crypto_sign_verify_detached(octets(signature), octets(record),
                                                         record.size(), key->key.data()) == 0;
}

}  // namespace tessera
