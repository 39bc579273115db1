// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/fragment_assembler.hpp"

#include <algorithm>

namespace tessera {
namespace {

AssemblerConfig within_ranges(AssemblerConfig config) {
  config.slots = std::clamp<std::size_t>(config.slots, 1, AssemblerConfig::kMostSlots);
  config.max_message_bytes =
      std::clamp<std::size_t>(config.max_message_bytes, 1, std::size_t{1} << 30U);
  config.max_fragments = std::clamp<std::size_t>(config.max_fragments, 1, 65'535);
  config.timeout_us = std::max<std::int64_t>(config.timeout_us, 0);
  return config;
}

}  // namespace

std::size_t FragmentAssembler::required_bytes(const AssemblerConfig& given) noexcept {
  const AssemblerConfig config = within_ranges(given);
  return config.slots *
         (config.max_message_bytes + config.max_fragments * sizeof(Part) + sizeof(Slot));
}

FragmentAssembler::FragmentAssembler(const AssemblerConfig& config)
    : config_(within_ranges(config)),
      payloads_(std::make_unique<std::byte[]>(config_.slots * config_.max_message_bytes)),
      parts_(std::make_unique<Part[]>(config_.slots * config_.max_fragments)),
      slots_(std::make_unique<Slot[]>(config_.slots)) {
  for (std::size_t i = 0; i < config_.slots; ++i) {
    slots_[i].payload = {payloads_.get() + i * config_.max_message_bytes,
                         config_.max_message_bytes};
    slots_[i].parts = {parts_.get() + i * config_.max_fragments, config_.max_fragments};
  }
}

FragmentAssembler::Slot* FragmentAssembler::find(const Endpoint& sender,
                                                 std::uint32_t sequence) noexcept {
  for (Slot& slot : std::span(slots_.get(), config_.slots)) {
    if (slot.stage != Stage::kEmpty && slot.sequence == sequence && slot.sender == sender)
      return &slot;
  }
  return nullptr;
}

FragmentAssembler::Slot& FragmentAssembler::room_for(const Endpoint& sender,
                                                     std::int64_t now_us) noexcept {
  const std::span<Slot> slots(slots_.get(), config_.slots);
  std::size_t of_sender = 0;
  Slot* senders_oldest = nullptr;
  Slot* unused = nullptr;
  Slot* silent = nullptr;
  for (Slot& slot : slots) {
    if (slot.stage != Stage::kUnderWay) {
      // First the complete one, so that late repeats of the others are recognised.
      if (unused == nullptr || slot.begun < unused->begun) unused = &slot;
      continue;
    }
    if (silent == nullptr || slot.last_us < silent->last_us) silent = &slot;
    if (!(slot.sender == sender)) continue;
    ++of_sender;
    if (senders_oldest == nullptr || slot.begun < senders_oldest->begun) senders_oldest = &slot;
  }
  if (of_sender >= kMostOfSender) {
    ++report_.superseded;
    return *senders_oldest;
  }
  if (unused != nullptr) return *unused;
  // All are in use, so one of them was silent for longest.
  ++(now_us - silent->last_us >= config_.timeout_us ? report_.timed_out : report_.evicted);
  return *silent;
}

void FragmentAssembler::begin(Slot& slot, const Endpoint& sender,
                              const Fragment& fragment) noexcept {
  slot.stage = Stage::kUnderWay;
  slot.sender = sender;
  slot.sequence = fragment.sequence;
  slot.message_bytes = fragment.message_bytes;
  slot.fragments = fragment.fragments;
  slot.taken = 0;
  slot.begun = ++begun_;
  slot.channel_bytes = 0;
  std::fill_n(slot.parts.begin(), fragment.fragments, Part{});
}

bool FragmentAssembler::add(Slot& slot, const Fragment& fragment) noexcept {
  Part& part = slot.parts[fragment.number];
  const auto bytes = static_cast<std::uint32_t>(fragment.payload.size());
  if (part.bytes != 0) {
    const bool same = part.offset == fragment.offset && part.bytes == bytes;
    ++(same ? report_.duplicates : report_.inconsistent);
    return false;
  }
  ++report_.taken;
  part = {fragment.offset, bytes};
  std::copy(fragment.payload.begin(), fragment.payload.end(),
            slot.payload.begin() + fragment.offset);
  if (fragment.number == 0) {
    slot.channel_bytes = fragment.channel.size();
    std::copy(fragment.channel.begin(), fragment.channel.end(), slot.channel.begin());
  }
  return ++slot.taken == slot.fragments;
}

bool FragmentAssembler::covers(const Slot& slot) noexcept {
  std::uint64_t end = 0;
  for (const Part& part : slot.parts.first(slot.fragments)) {
    if (part.offset != end) return false;
    end += part.bytes;
  }
  return end == slot.message_bytes;
}

FragmentAssembler::Message FragmentAssembler::take(const Endpoint& sender,
                                                   std::span<const std::byte> datagram,
                                                   std::int64_t now_us) noexcept {
  Fragment fragment;
  if (read_fragment(datagram, fragment) != FragmentFault::kNone) {
    ++report_.malformed;
    return {};
  }
  if (fragment.message_bytes > config_.max_message_bytes ||
      fragment.fragments > config_.max_fragments) {
    ++report_.too_large;
    return {};
  }
  Slot* slot = find(sender, fragment.sequence);
  // A restarted program may have the same port, and counts from zero.
  if (slot != nullptr && now_us - slot->last_us >= config_.timeout_us) {
    if (slot->stage == Stage::kUnderWay) ++report_.timed_out;
    slot->stage = Stage::kEmpty;
    slot = nullptr;
  }
  if (slot != nullptr) {
    if (slot->message_bytes != fragment.message_bytes || slot->fragments != fragment.fragments) {
      ++report_.inconsistent;
      return {};
    }
    if (slot->stage == Stage::kDone) {
      ++report_.duplicates;
      return {};
    }
  } else {
    slot = &room_for(sender, now_us);
    begin(*slot, sender, fragment);
  }
  slot->last_us = now_us;
  if (!add(*slot, fragment)) return {};
  slot->stage = Stage::kDone;
  if (!covers(*slot)) {
    ++report_.torn;
    return {};
  }
  ++report_.messages;
  return {{slot->channel.data(), slot->channel_bytes},
          std::span<const std::byte>(slot->payload).first(slot->message_bytes)};
}

}  // namespace tessera
