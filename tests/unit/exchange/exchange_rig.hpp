// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The parts of one robot's exchange, each within reach: for tests of those that write what is sent,
// and of the one that takes what is heard. Nothing is signed.
#pragma once

#include <vector>

#include "support/sample_content.hpp"
#include "tessera/exchange/internal/message_taker.hpp"

namespace tessera {

inline constexpr int kExchangeComponents = 5;

struct ExchangeRig {
  static constexpr ReplicasConfig kReplicas{
      .segments = 2048, .blocks = 64, .contributions = 128, .robot_segments = 2048};

  explicit ExchangeRig(std::uint32_t robot) : ExchangeRig(config_of(robot)) {}
  explicit ExchangeRig(const ExchangeConfig& given)
      : config(given),
        memory(Replicas::required_bytes(kReplicas) + Gate::required_bytes(config) +
               Ledger::required_bytes(config, kExchangeComponents) +
               Repair::required_bytes(config) + Sender::required_bytes(config) +
               MessageTaker::required_bytes() + arena_bytes<HashTree>(1)) {
    Arena arena = memory.arena();
    replicas = *Replicas::make(arena, kReplicas);
    const ConfigurationDetails details{.resolution_m = config.resolution_m, .classes = 3};
    gate = *Gate::make(arena, config, details, crc_authenticator(), {});
    ledger = *Ledger::make(arena, config, store_of(replicas), gate, kExchangeComponents);
    repair = *Repair::make(arena, config);
    sender = *Sender::make(arena, config);
    messages = *MessageTaker::make(arena, config);
    tree = arena.take<HashTree>(1).data();
  }
  ExchangeRig(const ExchangeRig&) = delete;
  ExchangeRig& operator=(const ExchangeRig&) = delete;

  static ExchangeConfig config_of(std::uint32_t robot) {
    ExchangeConfig config;
    config.robot = robot;
    config.contributions = 8;
    config.records = kReplicas.blocks;
    config.peers = 4;
    return config;
  }
  [[nodiscard]] ExchangeParts parts() { return {gate, ledger, repair, sender, counted}; }
  [[nodiscard]] Outgoing outgoing(Instant now) {
    return {.gate = gate,
            .ledger = ledger,
            .repair = repair,
            .now = now,
            .tree = *tree,
            .counted = counted};
  }
  const HeldContribution& open_own() {
    REQUIRE(ledger.open(1, 0, Matrix34d::Identity(), counted) == Status::kOk);
    return *ledger.publishing();
  }
  /// Publishes a block; the versions that it got.
  VersionRange publish(BlockCoord block, const BlockContent& content) {
    VersionRange published;
    REQUIRE(ledger.publish(*pack(block), content, published, counted).ok());
    return published;
  }
  /// The same with evidence in one voxel.
  VersionRange publish(BlockCoord block, float count = 2.0F) {
    OwnContent content(kExchangeComponents);
    content->add(1, 8, count);
    return publish(block, *content);
  }
  Peer& peer(std::uint32_t robot, Instant now) {
    Peer* const found = gate.peers().find_or_add(robot, now);
    REQUIRE(found != nullptr);
    found->heard = now;
    return *found;
  }
  /// A message that passed the gate.
  void hear(DatagramKind kind, std::uint32_t from, std::span<const std::byte> body, Instant now,
            bool is_last = true) {
    Heard heard;
    heard.header.kind = kind;
    heard.header.sender = from;
    heard.header.session = 1;
    heard.peer = &peer(from, now);
    heard.is_last = is_last;
    heard.body = body;
    heard.now = now;
    messages.hear(parts(), heard);
  }

  ExchangeConfig config;
  AlignedMemory memory;
  Replicas replicas;
  Gate gate;
  Ledger ledger;
  Repair repair;
  Sender sender;
  MessageTaker messages;
  HashTree* tree = nullptr;
  ExchangeReport counted;
};

inline constexpr Instant at_ms(std::int64_t ms) { return Instant::at_us(1'000 * ms); }

/// The frames of a body without proofs and signature, if all of it is well formed.
inline std::vector<FrameBody> frames_of(std::span<const std::byte> body) {
  ByteReader from(body);
  FramesHeader header;
  REQUIRE(read_frames_header(from, header));
  FrameReader reader(from, header.robot, false);
  std::vector<FrameBody> frames;
  std::span<const std::byte> proof;
  while (from.remaining() != 0) REQUIRE(reader.read(frames.emplace_back(), proof));
  return frames;
}

/// A body in as many bytes as it takes.
template <class Write>
std::vector<std::byte> written_by(Write&& write) {
  std::vector<std::byte> body(kMostBodyBytes);
  ByteWriter to(body);
  write(to);
  REQUIRE(to.ok());
  body.resize(to.size());
  return body;
}

}  // namespace tessera
