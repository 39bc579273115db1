// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/record_signature.hpp"

#include <sodium.h>

#include <algorithm>

#include "link/octets.hpp"
#include "tessera/base/assert.hpp"

namespace tessera {
namespace {

static_assert(kSignatureBytes == crypto_sign_BYTES);
static_assert(kKeyBytes == crypto_sign_SEEDBYTES && kKeyBytes == crypto_sign_PUBLICKEYBYTES);

/// The signed bytes, which libsodium needs in one piece.
class SignedBytes {
 public:
  /// Its size is 0 iff the record is too long.
  SignedBytes(const Mission::Value& mission, std::span<const std::byte> record) noexcept {
    if (record.size() > kMostSignedBytes) return;
    std::copy(mission.begin(), mission.end(), bytes_.begin());
    std::copy(record.begin(), record.end(), bytes_.begin() + mission.size());
    size_ = mission.size() + record.size();
  }
  [[nodiscard]] const unsigned char* data() const noexcept { return octets(bytes_); }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }

 private:
  std::array<std::byte, Mission::kValueBytes + kMostSignedBytes> bytes_{};
  std::size_t size_ = 0;
};

}  // namespace

Outcome<RecordSigner> RecordSigner::make(const RobotSecret& secret, const Mission& mission) {
  static_assert(kExpandedBytes == crypto_sign_SECRETKEYBYTES);
  if (::sodium_init() < 0) return Failure{"libsodium does not start", FailureKind::kFailure};
  RecordSigner signer;
  signer.robot_ = secret.robot;
  signer.mission_ = mission.value();
  std::array<unsigned char, kKeyBytes> open{};
  ::crypto_sign_seed_keypair(open.data(), signer.key_.data(), secret.seed.bytes().data());
  return signer;
}

RecordSigner::RecordSigner(RecordSigner&& other) noexcept
    : robot_(other.robot_), mission_(other.mission_), key_(other.key_) {
  ::sodium_memzero(other.key_.data(), other.key_.size());
}

RecordSigner::~RecordSigner() { ::sodium_memzero(key_.data(), key_.size()); }

void RecordSigner::sign(std::span<const std::byte> record,
                        std::span<std::byte, kSignatureBytes> signature) const noexcept {
  const SignedBytes message(mission_, record);
  TESSERA_ASSERT(message.size() > 0);
  std::fill(signature.begin(), signature.end(), std::byte{0});
  if (message.size() == 0) return;
  ::crypto_sign_detached(reinterpret_cast<unsigned char*>(signature.data()), nullptr,
                         message.data(), message.size(), key_.data());
}

Outcome<RecordVerifier> RecordVerifier::make(std::vector<RobotPublic> keys,
                                             const Mission& mission) {
  if (::sodium_init() < 0) return Failure{"libsodium does not start", FailureKind::kFailure};
  return RecordVerifier(std::move(keys), mission);
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
  const SignedBytes message(mission_, record);
  return key != nullptr && message.size() > 0 &&
         ::crypto_sign_verify_detached(octets(signature), message.data(), message.size(),
                                       key->key.data()) == 0;
}

}  // namespace tessera
