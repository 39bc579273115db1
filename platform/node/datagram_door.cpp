// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/datagram_door.hpp"

#include <algorithm>

#include "tessera/exchange/wire.hpp"

namespace tessera {

PayloadVerdict DatagramDoor::judge(std::span<const std::byte> datagram) const noexcept {
  if (datagram.size() < kHeaderBytes + kTagBytes || datagram.size() > kMostDatagramBytes)
    return PayloadVerdict::kFormat;
  ByteReader reader(datagram.first(kHeaderBytes));
  DatagramHeader header;
  if (!read_header(reader, header)) return PayloadVerdict::kFormat;
  // Checked before the tag, whose key depends on the mission.
  if (header.mission != mission_) return PayloadVerdict::kMission;
  const std::span<const std::byte> message = datagram.first(datagram.size() - kTagBytes);
  if (!authenticator_.check(authenticator_.context, message, datagram.last<kTagBytes>()))
    return PayloadVerdict::kTag;
  return is_excluded(header.sender) ? PayloadVerdict::kExcluded : PayloadVerdict::kTaken;
}

PayloadVerdict DatagramDoor::judge_status_of(std::span<const std::byte> status) const noexcept {
  const PayloadVerdict verdict = judge_status(status, status_);
  if (verdict != PayloadVerdict::kTaken) return verdict;
  return is_excluded(read_status(status).robot) ? PayloadVerdict::kExcluded
                                                : PayloadVerdict::kTaken;
}

void DatagramDoor::set_excluded(std::span<const std::uint32_t> robots) noexcept {
  Excluded next;
  next.count = static_cast<std::uint32_t>(std::min(robots.size(), next.robots.size()));
  std::copy_n(robots.begin(), next.count, next.robots.begin());
  excluded_.set(next);
}

/// The exchange refuses what passes here while the list is changed.
bool DatagramDoor::is_excluded(std::uint32_t robot) const noexcept {
  Excluded excluded;
  if (!excluded_.get(excluded)) return false;
  const auto all = std::span(excluded.robots).first(excluded.count);
  return std::find(all.begin(), all.end(), robot) != all.end();
}

PayloadCheck DatagramDoor::check() noexcept {
  return {this, [](void* door, std::span<const std::byte> payload) noexcept {
            return static_cast<const DatagramDoor*>(door)->judge(payload);
          }};
}

PayloadCheck DatagramDoor::status_check() noexcept {
  return {this, [](void* door, std::span<const std::byte> payload) noexcept {
            return static_cast<const DatagramDoor*>(door)->judge_status_of(payload);
          }};
}

}  // namespace tessera
