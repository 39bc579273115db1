// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The sketch of what has arrived of another robot's map, or of what this one has published. Other
// versions and blocks may arrive, and blocks may go, while it is taken.
#pragma once

#include <span>

#include "tessera/frames/sketch_source.hpp"
#include "tessera/map/internal/packed_block.hpp"
#include "tessera/replica/replicas.hpp"

namespace tessera {

/// The replicas of one contribution, in its own frame (T_global_local plays no part). Each block is
/// read as a local map reads it that holds the same and nothing else; objections do not count.
///
/// The blocks are those that were there at begin(). Each is taken once at most, as it is when its
/// turn comes; one that has gone by then is left out, one that came later too. A sketch that it
/// took before of the same contribution, and that has not been another's since, it brings up to
/// date: only blocks that have changed are read, and the sketch is the same as if all had been.
/// Copies share the memory, and the one that began it alone must be used and stay where it is.
class ReplicaSketchSource {
 public:
  /// A piece is so many blocks, or fewer, of which the last reaches so many packed bytes: blocks
  /// with evidence of many classes are the longest work.
  static constexpr std::size_t kBlocks = 16;
  static constexpr std::size_t kMostBytes = std::size_t{1} << 16U;
  /// Where little has changed, at most so many records are passed over in a piece, and so many
  /// blocks forgotten.
  static constexpr std::size_t kMostPassed = std::size_t{1} << 14U;
  static constexpr std::size_t kMostForgotten = 1'024;

  /// Of maps with this configuration, whose storage_bytes does not count, and num_components = C +
  /// 2; replicas: those that it will read.
  [[nodiscard]] static constexpr std::size_t required_bytes(
      const MapConfig& map, int num_components, const ReplicasConfig& replicas) noexcept {
    return arena_bytes<Note>(replicas.blocks) + arena_bytes<Scratch>(1) +
           tessera::required_bytes(scratch_map(map, num_components)) +
           BlockContent::required_bytes(num_components) +
           arena_bytes<std::byte>(most_packed_bytes(num_components));
  }
  /// map, classes: of the maps whose blocks these are; how their counts are read is of them. Fails
  /// with kInvalidArgument iff a value of map but storage_bytes is outside its range or there is no
  /// class; kResourceExhausted iff the arena has too little memory or is not aligned.
  [[nodiscard]] static Result<ReplicaSketchSource> make(Arena& arena, const MapConfig& map,
                                                        const ClassTable& classes,
                                                        const ReplicasConfig& replicas) noexcept;
  /// Has no memory: begin() fails.
  ReplicaSketchSource() noexcept = default;

  /// Begins anew with the blocks that a contribution has now. replicas must outlive what is taken.
  /// Fails with kInvalidArgument iff the slot has no contribution, one that is leaving, or one
  /// without blocks (has_blocks); kResourceExhausted iff replicas have room for more parts of
  /// blocks than those that the source was made for. It has lost nothing and has no block then.
  /// O(parts of blocks), at most two look-ups each.
  [[nodiscard]] Status begin(const Replicas& replicas, Replicas::Slot slot) noexcept;

  /// For FrameFinder::begin. A piece is for each of its blocks a look-up, all that its parts have
  /// packed, LocalMap::replace and MapSketch::add. On x86-64, 2 million instructions for the blocks
  /// of a hall, 6 million for 16 blocks with one class and passes in each voxel, and 4.4 million
  /// for one block in four parts with all of 62 classes in each voxel; both together at worst.
  [[nodiscard]] SketchSource source() const noexcept;

  /// True iff the contribution was closed, was leaving, or its slot was another's when a piece was
  /// to be taken: the source ended there, and what a finder makes of it is invalid.
  /// Asked once the finder has taken it in.
  [[nodiscard]] bool lost() const noexcept { return scratch_ != nullptr && scratch_->lost; }
  /// The contribution, as of begin().
  [[nodiscard]] const ContributionId& id() const noexcept { return id_; }
  /// Of all parts of blocks in the sketch the highest version; 0: there is none. Others may be
  /// older.
  [[nodiscard]] std::uint32_t newest_version() const noexcept {
    return scratch_ == nullptr ? 0 : scratch_->newest_version;
  }
  /// Blocks that were read since begin(), those known to be empty included; and those that had gone
  /// when their turn came.
  [[nodiscard]] std::uint32_t blocks_taken() const noexcept {
    return scratch_ == nullptr ? 0 : scratch_->blocks_taken;
  }
  [[nodiscard]] std::uint32_t blocks_gone() const noexcept {
    return scratch_ == nullptr ? 0 : scratch_->blocks_gone;
  }

 private:
  /// What the sketch has of a record of the replicas; by the record's number.
  struct Note {
    static constexpr unsigned kLive = kAllLayers;  ///< Of Replica::live, as it was taken.
    static constexpr unsigned kTaken = 1U << 4U;
    static constexpr unsigned kFirst = 1U << 5U;  ///< Taken, as the first part of a block.
    static constexpr unsigned kThere = 1U << 6U;  ///< Of the contribution at begin().
    static constexpr unsigned kChanged = 1U
                                         << 7U;  ///< The first part of a block that is to be taken.

    std::uint64_t key = 0;
    std::uint32_t version = 0;
    MapSketch::BlockCells cells = 0;  ///< Of the block, if kFirst.
    std::uint8_t marks = 0;
    std::uint8_t hash = 0;  ///< Of PartVersion::hash: a version may have another content.

    [[nodiscard]] bool has(unsigned all) const noexcept { return (marks & all) == all; }
    [[nodiscard]] bool is_of(const Replicas::Replica& part) const noexcept {
      return has(kTaken) && key == part.key && version == part.version &&
             (marks & kLive) == part.live && hash == static_cast<std::uint8_t>(part.hash.low);
    }
  };
  static_assert(sizeof(Note) == 16 && kAllLayers < Note::kTaken);

  /// What changes while it is taken.
  struct Scratch {
    LocalMap map;  ///< Of one block at a time.
    BlockContent content;
    std::span<std::byte> packed;
    MapSketch::Owner owner;   ///< Of the sketch that the notes are of, if it is whole.
    std::uint64_t turns = 0;  ///< Sketches that were taken so far.
    std::size_t noted = 0;    ///< Records with a note have lower numbers.
    std::size_t end = 0;      ///< The same at begin().
    bool is_whole = true;     ///< The notes have all that is in the sketch.
    bool lost = false;
    std::uint32_t newest_version = 0;
    std::uint32_t blocks_taken = 0;
    std::uint32_t blocks_gone = 0;
  };

  /// The same with room for one block that has all that a block can have.
  [[nodiscard]] static constexpr MapConfig scratch_map(MapConfig map, int num_components) noexcept {
    const std::uint32_t octet_bytes = TupleStore::octet_bytes(map.tuple, num_components);
    const std::size_t octets_page = SlabPool::kPageBytes / octet_bytes;
    const std::size_t octet_pages = (kBlockOctets + octets_page - 1) / octets_page;
    map.storage_bytes = (3 + octet_pages) * SlabPool::kPageBytes;  // itself, labels, passes
    return map;
  }
  /// The cursor goes through the notes twice: what has changed is forgotten, and then taken.
  static bool take(const void* context, SketchSource::Cursor& cursor, MapSketch& sketch) noexcept;
  [[nodiscard]] bool is_there() const noexcept;
  [[nodiscard]] bool is_as_taken(const Replicas::Replica& first) const noexcept;
  void note_part(const Replicas::Replica& part) noexcept;
  void note_parts_gone() const noexcept;
  /// Whether the sketch is the one that the notes are of.
  [[nodiscard]] bool goes_on(const MapSketch& sketch) const noexcept;
  void begin_sketch(MapSketch& sketch) const noexcept;
  void forget_some(std::size_t& at, MapSketch& sketch) const noexcept;
  void take_some(std::size_t& at, MapSketch& sketch) const noexcept;
  /// Returns the packed bytes.
  std::size_t add_block(BlockKey key, MapSketch& sketch) const noexcept;
  /// Fills in the block's parts. Returns their packed bytes.
  std::size_t note_taken(const Replicas::Replica& first) const noexcept;

  const Replicas* replicas_ = nullptr;
  Replicas::Slot slot_ = 0;
  ContributionId id_;
  bool has_begun_ = false;
  std::span<Note> notes_;
  Scratch* scratch_ = nullptr;
};

}  // namespace tessera
