// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/side_intake.hpp"

#include <algorithm>

namespace tessera {

SideIntake::SideIntake(const SideChannel& config)
    : config_(config), queue_(config.channel.empty() ? 1 : config.queue_slots) {}

bool SideIntake::take(std::span<const std::byte> payload) noexcept {
  const PayloadCheck& check = config_.check;
  const PayloadVerdict verdict =
      check.check == nullptr ? PayloadVerdict::kTaken : check.check(check.context, payload);
  switch (verdict) {
    case PayloadVerdict::kFormat:
    case PayloadVerdict::kMission:  // Statuses do not name theirs.
      count(kRefusedFormat);
      return false;
    case PayloadVerdict::kTag:
      count(kRefusedTag);
      return false;
    case PayloadVerdict::kExcluded:
      count(kRefusedExcluded);
      return false;
    case PayloadVerdict::kTaken:
      break;
  }
  Slot* const slot = queue_.claim();
  if (slot == nullptr) {
    count(kQueueFull);
    return true;
  }
  slot->bytes = static_cast<std::uint32_t>(payload.size());
  std::copy(payload.begin(), payload.end(), slot->payload.begin());
  queue_.publish();
  count(kReceived);
  return true;
}

std::span<const std::byte> SideIntake::receive(
    std::span<std::byte, kMaxMessageBytes> into) noexcept {
  const Slot* const slot = queue_.front();
  if (slot == nullptr) return {};
  std::copy_n(slot->payload.begin(), slot->bytes, into.begin());
  const auto received = std::span<const std::byte>(into).first(slot->bytes);
  queue_.pop();
  return received;
}

SideReport SideIntake::report() const noexcept {
  const auto value = [this](Counter counter) {
    return counters_[counter].load(std::memory_order_relaxed);
  };
  return {value(kReceived), value(kRefusedFormat), value(kRefusedTag), value(kRefusedExcluded),
          value(kQueueFull)};
}

}  // namespace tessera
