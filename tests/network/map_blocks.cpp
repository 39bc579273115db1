// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "network/map_blocks.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <tuple>

#include "tessera/exchange/internal/block_codec.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera::network {

namespace {

ByteSource source_of(std::ifstream& file) {
  return {&file, [](void* context, std::span<std::byte> into) -> std::size_t {
            auto& from = *static_cast<std::ifstream*>(context);
            from.read(reinterpret_cast<char*>(into.data()),
                      static_cast<std::streamsize>(into.size()));
            return static_cast<std::size_t>(from.gcount());
          }};
}

}  // namespace

MapBlocks::MapBlocks(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const auto buffer = std::make_unique<MapFileBuffer>();
  MapFileHeader header;
  const ByteSource source = source_of(file);
  const auto check = [&](const MapFileStatus& status) {
    if (!status.ok()) throw std::runtime_error(path + ": " + status.what);
  };
  check(load_header(source, *buffer, header));
  if (header.identity.kind != MapKind::kLocal)
    throw std::runtime_error(path + " is a global map; give a local one");
  memory_ = std::make_unique<AlignedMemory>(required_bytes(header.config));
  Arena arena(memory_->span());
  Result<LocalMap> map = LocalMap::make(arena, header.config, header.classes);
  if (!map.ok()) throw std::runtime_error(path + ": " + to_string(map.status()));
  map_ = std::move(*map);
  check(load_blocks(source, header, *buffer, map_));
  blocks_.resize(2 * map_.block_count());
  const std::span<const KeyedIndex> in_order = map_.blocks_in_order(blocks_);
  std::vector<KeyedIndex> along_x(in_order.begin(), in_order.end());
  std::sort(along_x.begin(), along_x.end(), [](const KeyedIndex& a, const KeyedIndex& b) {
    const BlockCoord at_a = unpack(BlockKey{a.key});
    const BlockCoord at_b = unpack(BlockKey{b.key});
    return std::tie(at_a.x, at_a.y, at_a.z) < std::tie(at_b.x, at_b.y, at_b.z);
  });
  blocks_ = std::move(along_x);
}

BlockKey MapBlocks::read(std::size_t i, BlockContent& content) const {
  content.clear();
  const Block& block = map_.block_at(blocks_[i].index);
  add_block(map_, block, content);
  quantise(content);
  return BlockKey{block.key};
}

}  // namespace tessera::network
