// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/map_file.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "fuzz/fuzz.hpp"
#include "support/mapper.hpp"
#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/internal/crc32.hpp"
#include "tessera/map/queries.hpp"
#include "tessera/map/stored_block.hpp"

namespace tessera::fuzz {

namespace {

constexpr std::size_t kMostStorage = std::size_t{1} << 20U;
using StoredBytes = std::vector<std::byte>;

/// Puts checksums right, so that what they protect is reached: no fuzzer finds one by chance.
class Mender {
 public:
  explicit Mender(StoredBytes& bytes) : bytes_(bytes) {}
  /// Of a header whose length is believed.
  void header() {
    const std::uint32_t body = ByteReader(at(12, 4)).u32();
    skip(16);
    skip(body);
    checksum();
  }
  /// A block's head and content, as far as the bytes go.
  void block() {
    const Bytes head = at(at_, 21);
    skip(21);
    checksum();
    ByteReader reader(head);
    static_cast<void>(reader.u64());
    static_cast<void>(reader.u32());
    const unsigned parts = reader.u8();
    if ((parts & 15U) == 1) skip(kBlockVoxels);
    for (unsigned layers = parts >> 4U; layers != 0; layers &= layers - 1)
      skip(std::size_t{9} * u8());
    for (std::uint64_t octets = reader.u64(); octets != 0 && more(); octets &= octets - 1) {
      for (unsigned voxels = u8(); voxels != 0 && more(); voxels &= voxels - 1)
        skip(std::size_t{5} * u8() + 1);
    }
    checksum();
  }
  void end() {
    skip(12);
    checksum();
  }
  [[nodiscard]] bool more() const { return at_ < bytes_.size(); }
  [[nodiscard]] bool at_end_mark() const {
    return at_ + 16 >= bytes_.size() || ByteReader(at(at_, 4)).u32() == 0x454e4421U;
  }

 private:
  [[nodiscard]] Bytes at(std::size_t place, std::size_t count) const {
    return place + count <= bytes_.size() ? Bytes(bytes_).subspan(place, count) : Bytes{};
  }
  unsigned u8() { return more() ? std::to_integer<unsigned>(bytes_[at_++]) : 0; }
  void skip(std::size_t count) { at_ = std::min(at_ + count, bytes_.size()); }
  void checksum() {
    const std::uint32_t crc = crc32c(Bytes(bytes_).subspan(since_, at_ - since_));
    if (at_ + 4 <= bytes_.size()) ByteWriter(std::span(bytes_).subspan(at_, 4)).u32(crc);
    skip(4);
    since_ = at_;
  }

  StoredBytes& bytes_;
  std::size_t at_ = 0;
  std::size_t since_ = 0;
};

struct Source {
  Bytes bytes;
  ByteSource source() {
    return {this, [](void* context, std::span<std::byte> into) {
              auto& self = *static_cast<Source*>(context);
              const std::size_t n = std::min(into.size(), self.bytes.size());
              std::copy_n(self.bytes.begin(), n, into.begin());
              self.bytes = self.bytes.subspan(n);
              return n;
            }};
  }
};

class OwnMap {
 public:
  OwnMap(MapConfig config, const ClassTable& classes) : memory_(required_bytes(config)) {
    Arena arena(memory_.span());
    Result<LocalMap> made = LocalMap::make(arena, config, classes);
    require(made.ok(), "what a header says is no map");
    map_ = std::move(*made);
  }
  LocalMap& operator*() { return map_; }

 private:
  AlignedMemory memory_;
  LocalMap map_;
};

std::uint64_t digest_of(const LocalMap& map) {
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  return digest(map, workspace);
}

StoredBytes saved(const LocalMap& map, const MapIdentity& identity) {
  static MapFileBuffer buffer;
  StoredBytes bytes;
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  const ByteSink sink{&bytes, [](void* context, std::span<const std::byte> more) {
                        auto& all = *static_cast<StoredBytes*>(context);
                        all.insert(all.end(), more.begin(), more.end());
                        return true;
                      }};
  require(save(map, identity, workspace, buffer, sink).ok(), "a loaded map is not saved");
  return bytes;
}

/// Nothing if there is no such map; its header says why not.
bool load(Bytes bytes, std::optional<OwnMap>& map, MapFileHeader& header) {
  static MapFileBuffer buffer;
  Source source{bytes};
  const MapFileStatus head = load_header(source.source(), buffer, header);
  require(head.ok() || head.what[0] != '\0', "an error without a word");
  require(head.offset_bytes <= bytes.size(), "an error beyond the end");
  if (!head.ok()) return false;
  require(in_range(header.config), "settings out of range");
  // Who loads decides how much memory there is, whatever the header wishes.
  header.config.storage_bytes = std::min(header.config.storage_bytes, kMostStorage);
  map.emplace(header.config, header.classes);
  const MapFileStatus status = load_blocks(source.source(), header, buffer, **map);
  require(status.ok() || status.what[0] != '\0', "an error without a word");
  require(status.ok() || (**map).block_count() == 0, "half a map");
  require(status.offset_bytes <= bytes.size(), "an error beyond the end");
  return status.ok();
}

void whole_file(Bytes bytes) {
  static MapFileHeader header;
  static MapFileHeader again;
  std::optional<OwnMap> map;
  if (!load(bytes, map, header)) return;
  const StoredBytes first = saved(**map, header.identity);
  std::optional<OwnMap> second;
  require(load(first, second, again), "what was saved is not loaded");
  require(digest_of(**map) == digest_of(**second), "another digest");
  require(saved(**second, again.identity) == first, "saved otherwise the second time");
  // Of this very version there is one way to write a map.
  const bool same_version =
      bytes.size() == first.size() && std::equal(first.begin(), first.begin() + 16, bytes.begin());
  require(!same_version || std::equal(bytes.begin(), bytes.end(), first.begin()), "not canonical");
}

/// A block that an archive gives back, into a map that has room for one.
void one_block(Bytes bytes, int classes, TuplePolicy policy, bool votes) {
  MapConfig config = oracle::uncapped_map(0.1);
  config.tuple = policy;
  config.storage_bytes = one_block_storage(policy, classes + 2);
  config.label_votes = votes;
  OwnMap own(config, oracle::numbered_classes(classes));
  LocalMap& map = *own;
  const MapFileStatus status = restore_block(bytes, map);
  require(status.ok() || status.what[0] != '\0', "an error without a word");
  require(status.offset_bytes <= bytes.size() + 4, "an error beyond the end");
  if (!status.ok()) return;
  require(map.block_count() == 1, "not one block");
  std::vector<std::byte> coded(most_block_bytes(map.num_components()));
  ByteReader key(bytes);
  const Block* const block = map.find(unpack(BlockKey{key.u64()}));
  require(block != nullptr, "another block");
  coded.resize(save_block(map, *block, coded));
  require(!coded.empty(), "a block without anything");
  OwnMap other(config, oracle::numbered_classes(classes));
  require(restore_block(coded, *other).ok(), "what was coded is not decoded");
  require(digest_of(map) == digest_of(*other), "another digest");
  std::vector<std::byte> again(coded.size());
  const Block* const same = (*other).find(unpack(BlockKey{block->key}));
  again.resize(save_block(*other, *same, again));
  require(again == coded, "other votes or counts");  // the digest is of no votes
}

}  // namespace

void map_file(Bytes bytes) {
  Input input(bytes);
  const unsigned how = input.u8();
  StoredBytes all(input.rest().begin(), input.rest().end());
  Mender mender(all);
  const bool mend = (how & 1U) != 0;
  if ((how & 2U) != 0) {
    if (mend) mender.block();
    return one_block(all, 1 + static_cast<int>((how >> 3U) & 15U),
                     (how & 4U) != 0 ? TuplePolicy::kCompact : TuplePolicy::kDense,
                     (how & 128U) != 0);
  }
  if (mend && all.size() >= 16) {
    mender.header();
    while (mender.more() && !mender.at_end_mark()) mender.block();
    mender.end();
  }
  whole_file(all);
}

}  // namespace tessera::fuzz
