// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What one robot holds of contributions, without network and time: a store, places, and records.
#pragma once

#include <vector>

#include "network/toy_signatures.hpp"
#include "support/sample_content.hpp"
#include "tessera/exchange/internal/chunk_taker.hpp"
#include "tessera/exchange/internal/record_maker.hpp"

namespace tessera {

inline constexpr int kRigComponents = 5;
inline constexpr std::uint32_t kRigConfiguration = 0x1234;
inline constexpr ReplicasConfig kRoomyReplicas{
    .segments = 2048, .blocks = 64, .contributions = 8, .robot_segments = 2048};

/// Evidence of one class in one voxel: a small block, and another one for each place and count.
inline void fill_voxel(BlockContent& content, int row, float count) {
  content.clear();
  content.add(1, row, count);
}

struct RecordsRig {
  explicit RecordsRig(std::uint32_t robot, bool signs = false,
                      const ReplicasConfig& room = kRoomyReplicas)
      : toy(robot),
        signatures(signs ? toy.signatures() : Signatures{}),
        memory(Replicas::required_bytes(room) + ContributionTable::required_bytes(config(room)) +
               HeldRecords::required_bytes(config(room), kRigComponents) +
               Conflicts::required_bytes() + RecordMaker::required_bytes() +
               ChunkTaker::required_bytes()),
        scratch(kRigComponents) {
    Arena arena = memory.arena();
    replicas = *Replicas::make(arena, room);
    const ReplicaStore store = store_of(replicas);
    table = *ContributionTable::make(arena, config(room), store);
    records = *HeldRecords::make(arena, config(room), store, signs, kRigComponents);
    conflicts = *Conflicts::make(arena);
    maker = *RecordMaker::make(arena, signatures, kRigComponents);
    taker = *ChunkTaker::make(arena, signatures, kRigConfiguration, kRigComponents);
  }
  RecordsRig(const RecordsRig&) = delete;
  RecordsRig& operator=(const RecordsRig&) = delete;

  static ExchangeConfig config(const ReplicasConfig& room) {
    ExchangeConfig config;
    config.contributions = 4;
    config.records = room.blocks;
    return config;
  }
  /// A contribution with a frame.
  HeldContribution& open(const ContributionId& id) {
    HeldContribution* const place =
        table.add(id, ContributionTable::Claim::kFrame, Instant::at_us(1), counted);
    REQUIRE(place != nullptr);
    REQUIRE(table.set_frame(*place, Matrix34d::Identity(), 1) == Status::kOk);
    return *place;
  }
  Result<std::uint32_t> publish(HeldContribution& own, BlockCoord block,
                                const BlockContent& content) {
    return maker.publish({table, records, *scratch, counted}, own, *pack(block), content,
                         published);
  }
  [[nodiscard]] ChunkTaker::Taken take(HeldContribution& contribution, const ChunkHeader& header,
                                       std::span<const std::byte> body, bool awaited = false) {
    return taker.take({table, records, conflicts, *scratch, counted}, contribution, {}, header,
                      body, awaited);
  }
  /// The records of these versions, as this robot passes them on.
  [[nodiscard]] std::vector<std::byte> body_of(const HeldContribution& contribution,
                                               const ChunkHeader& header) {
    std::vector<std::byte> body(kMostBodyBytes);
    ByteWriter to(body);
    RecordWriter writer(to, header.range);
    HashTree tree;
    for (std::uint32_t v = header.range.first; v <= header.range.last; ++v) {
      const Replicas::Replica* const part = records.find_version(contribution, v, 0).part;
      if (part == nullptr) continue;
      ChunkRecord record = records.read(*part);
      if (!header.relayed) record.proof = {};
      REQUIRE(writer.write(record));
      tree.add(leaf_of(signatures, contribution.id, record));
    }
    if (signatures.on() && !header.relayed) {
      tree.add(leaf_of(signatures, header.statement));
      Signature signature{};
      signatures.sign(
          signatures.context,
          root_message(kRigConfiguration, contribution.id, tree.count(), tree.root(signatures)),
          signature);
      to.bytes(signature);
    }
    REQUIRE(to.ok());
    body.resize(to.size());
    return body;
  }
  /// The header of a chunk of its own.
  [[nodiscard]] static ChunkHeader header_of(const HeldContribution& own, VersionRange range) {
    return {.id = own.id,
            .range = range,
            .statement = {.id = own.id,
                          .range = range,
                          .latest = own.latest,
                          .records = own.records,
                          .fingerprint = own.held,
                          .frame_revision = own.frame_revision,
                          .session = 1}};
  }

  network::ToySignatures toy;
  Signatures signatures;
  AlignedMemory memory;
  OwnContent scratch;
  Replicas replicas;
  ContributionTable table;
  HeldRecords records;
  Conflicts conflicts;
  RecordMaker maker;
  ChunkTaker taker;
  ExchangeReport counted;
  VersionRange published;
};

}  // namespace tessera
