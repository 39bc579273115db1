// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/status_message.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <tessera_status.hpp>

#include "link/status_publisher.hpp"

namespace tessera {
namespace {

constexpr std::size_t kSessionAt = kTypedStatusBytes;
constexpr std::size_t kSequenceAt = kSessionAt + 8;
constexpr std::size_t kSignatureAt = kSequenceAt + 4;

/// No other signed message begins with it, so that a signature is valid for one kind only.
constexpr std::string_view kSignedContext = "tessera 2 status";
using SignedBytes = std::array<std::byte, kSignedContext.size() + kSignatureAt>;

SignedBytes signed_bytes(std::span<const std::byte> status) noexcept {
  SignedBytes bytes;
  const auto end = std::transform(kSignedContext.begin(), kSignedContext.end(), bytes.begin(),
                                  [](char c) { return static_cast<std::byte>(c); });
  std::copy_n(status.begin(), kSignatureAt, end);
  return bytes;
}

void write_little(std::span<std::byte> into, std::uint64_t value) noexcept {
  for (std::byte& byte : into) {
    byte = static_cast<std::byte>(value & 0xffU);
    value >>= 8U;
  }
}

std::uint64_t read_little(std::span<const std::byte> bytes) noexcept {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i > 0; --i)
    value = value << 8U | std::to_integer<std::uint64_t>(bytes[i - 1]);
  return value;
}

/// The fingerprint of the type and the version of the message, at the begin of each status.
using Beginning = std::array<std::byte, 12>;

Beginning make_beginning() noexcept {
  std::array<std::byte, kTypedStatusBytes> bytes{};
  tessera_status message{};
  message.version = kStatusVersion;
  static_cast<void>(message.encode(bytes.data(), 0, static_cast<int>(bytes.size())));
  Beginning beginning;
  std::copy_n(bytes.begin(), beginning.size(), beginning.begin());
  return beginning;
}

bool begins_as_status(std::span<const std::byte> status) noexcept {
  static const Beginning kBeginning = make_beginning();
  return std::equal(kBeginning.begin(), kBeginning.end(), status.begin());
}

}  // namespace

void seal_status(std::span<std::byte> status, std::uint64_t session, std::uint32_t sequence,
                 const StatusKeys& keys) noexcept {
  write_little(status.subspan(kSessionAt, 8), session);
  write_little(status.subspan(kSequenceAt, 4), sequence);
  if (keys.signatures.on()) {
    keys.signatures.sign(keys.signatures.context, signed_bytes(status),
                         status.subspan(kSignatureAt).first<kSignatureBytes>());
  }
  if (keys.has_tag()) {
    keys.authenticator.tag(keys.authenticator.context, status.first(status.size() - kTagBytes),
                           status.last<kTagBytes>());
  }
}

PayloadVerdict judge_status(std::span<const std::byte> status, const StatusKeys& keys) noexcept {
  if (status.size() != keys.status_bytes() || !begins_as_status(status))
    return PayloadVerdict::kFormat;
  if (keys.has_tag() &&
      !keys.authenticator.check(keys.authenticator.context, status.first(status.size() - kTagBytes),
                                status.last<kTagBytes>()))
    return PayloadVerdict::kTag;
  return PayloadVerdict::kTaken;
}

HeardState read_status(std::span<const std::byte> status) noexcept {
  tessera_status message{};
  // It has a fixed size, so it is complete.
  static_cast<void>(message.decode(status.data(), 0, static_cast<int>(kTypedStatusBytes)));
  const std::int64_t* const extra = message.counters + kLinkCounters;
  return {.robot = static_cast<std::uint32_t>(message.robot),
          .epoch = static_cast<std::uint32_t>(message.epoch),
          .session = read_little(status.subspan(kSessionAt, 8)),
          .sequence = static_cast<std::uint32_t>(read_little(status.subspan(kSequenceAt, 4))),
          .exclude_digest = static_cast<std::uint32_t>(message.exclude_digest),
          .own_twins = static_cast<std::uint64_t>(extra[NodeState::kOwnTwins]),
          .other_twins = static_cast<std::uint64_t>(extra[NodeState::kOtherTwins]),
          .conflicts = static_cast<std::uint64_t>(extra[NodeState::kConflicts])};
}

bool check_status_signature(std::span<const std::byte> status, const StatusKeys& keys) noexcept {
  if (!keys.signatures.on()) return true;
  return keys.signatures.check(keys.signatures.context, read_status(status).robot,
                               signed_bytes(status),
                               status.subspan(kSignatureAt).first<kSignatureBytes>());
}

}  // namespace tessera
