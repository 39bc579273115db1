// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/datagram_seal.hpp"

#include <sodium.h>

#include <string_view>

#include "link/octets.hpp"

namespace tessera {
namespace {

/// By KeyUse. None is a prefix of another.
constexpr auto kContexts =
    std::to_array<std::string_view>({"tessera 2 datagram tag", "tessera 2 status tag"});
static_assert(kKeyBytes >= crypto_generichash_KEYBYTES_MIN &&
              kKeyBytes <= crypto_generichash_KEYBYTES_MAX);
static_assert(kKeyBytes <= crypto_generichash_BYTES_MAX);
static_assert(kTagBytes >= crypto_generichash_BYTES_MIN);

}  // namespace

Outcome<DatagramSeal> DatagramSeal::make(const SecretKey& fleet_key, const Mission& mission,
                                         KeyUse use) {
  if (::sodium_init() < 0) return Failure{"libsodium does not start", FailureKind::kFailure};
  DatagramSeal seal;
  std::array<unsigned char, kMostMissionInputBytes> input;
  const std::size_t bytes =
      write_mission_input(kContexts[static_cast<std::size_t>(use)], mission, input);
  // Fails only for lengths out of its range, and these are constants.
  ::crypto_generichash(seal.key_.bytes().data(), kKeyBytes, input.data(), bytes,
                       fleet_key.bytes().data(), kKeyBytes);
  return seal;
}

void DatagramSeal::tag(std::span<const std::byte> message,
                       std::span<std::byte, kTagBytes> tag) const noexcept {
  // Fails only for lengths of tag and key out of its range, and these are constants.
  ::crypto_generichash(reinterpret_cast<unsigned char*>(tag.data()), tag.size(), octets(message),
                       message.size(), key_.bytes().data(), kKeyBytes);
}

bool DatagramSeal::check(std::span<const std::byte> message,
                         std::span<const std::byte, kTagBytes> tag) const noexcept {
  std::array<std::byte, kTagBytes> wanted;
  this->tag(message, wanted);
  return ::sodium_memcmp(wanted.data(), tag.data(), kTagBytes) == 0;
}

Authenticator DatagramSeal::authenticator() noexcept {
  return {this,
          [](void* seal, std::span<const std::byte> message,
             std::span<std::byte, kTagBytes> tag) noexcept {
            static_cast<const DatagramSeal*>(seal)->tag(message, tag);
          },
          [](void* seal, std::span<const std::byte> message,
             std::span<const std::byte, kTagBytes> tag) noexcept {
            return static_cast<const DatagramSeal*>(seal)->check(message, tag);
          }};
}

}  // namespace tessera
