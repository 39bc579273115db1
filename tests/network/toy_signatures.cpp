// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "network/toy_signatures.hpp"

#include <algorithm>

#include "tessera/base/internal/digest.hpp"

namespace tessera::network {
namespace {

void fill(std::uint64_t seed, std::span<const std::byte> message, std::span<std::byte> into) {
  Digest digest;
  digest.add(seed);
  for (const std::byte byte : message) digest.add(std::to_integer<std::uint64_t>(byte));
  for (std::size_t i = 0; i < into.size(); ++i) {
    if (i % 8 == 0) digest.add(i);
    into[i] = static_cast<std::byte>(digest.value() >> (8 * (i % 8)) & 0xffU);
  }
}

}  // namespace

Signatures ToySignatures::signatures() {
  return {.context = this,
          .sign =
              [](void* self, std::span<const std::byte> message,
                 std::span<std::byte, kSignatureBytes> signature) noexcept {
                fill(static_cast<const ToySignatures*>(self)->robot_, message, signature);
              },
          .check =
              [](void* self, std::uint32_t robot, std::span<const std::byte> message,
                 std::span<const std::byte, kSignatureBytes> signature) noexcept {
                ++static_cast<ToySignatures*>(self)->checks_;
                Signature wanted;
                fill(robot, message, wanted);
                return std::equal(wanted.begin(), wanted.end(), signature.begin());
              },
          .hash =
              [](void* /*self*/, std::span<const std::byte> message,
                 std::span<std::byte, kHashBytes> hash) noexcept {
                fill(std::uint64_t{1} << 40U, message, hash);
              }};
}

}  // namespace tessera::network
