// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What this robot publishes: blocks as records that each fit a datagram, in parts where a block
// takes more.
#pragma once

#include "tessera/exchange/internal/held_records.hpp"

namespace tessera {

class RecordMaker {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes() noexcept {
    return arena_bytes<std::byte>(kMostCoded);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] static Result<RecordMaker> make(Arena& arena, const Signatures& signatures,
                                                int num_components) noexcept;
  RecordMaker() noexcept = default;

  /// Where records go.
  struct Into {
    ContributionTable& table;
    HeldRecords& records;
    BlockContent& scratch;
    ExchangeReport& counted;
  };
  /// Puts a block into the store as this robot's contribution has it from now on. published: gets
  /// the versions that were given, of at most four parts; at least their number. Returns the bytes
  /// on the wire. Fails with kResourceExhausted iff there are no more versions; as
  /// HeldRecords::put, and parts before that one stay. O(512 components).
  [[nodiscard]] Result<std::uint32_t> publish(const Into& into, HeldContribution& own, BlockKey key,
                                              const BlockContent& content,
                                              VersionRange& published) noexcept;

  /// The same of a contribution without blocks, whose records are not coded. O(bytes).
  [[nodiscard]] Result<std::uint32_t> publish_bytes(const Into& into, HeldContribution& own,
                                                    BlockKey place,
                                                    std::span<const std::byte> bytes) noexcept;

 private:
  static constexpr std::size_t kMostCoded = most_coded_bytes(kBlockLayers);
  [[nodiscard]] unsigned parts_of(const BlockContent& content, std::size_t whole_bytes) noexcept;
  [[nodiscard]] Status publish_parts(const Into& into, HeldContribution& own, BlockKey key,
                                     const BlockContent& content, unsigned parts,
                                     std::size_t whole_bytes, std::uint32_t& bytes) noexcept;

  Signatures signatures_{};
  int num_components_ = 0;
  std::span<std::byte> coded_;  ///< Scratch for a block's code.
};

}  // namespace tessera
