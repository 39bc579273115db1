// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "stored_bytes.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "tessera/base/internal/crc32.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

void put_u32(StoredBytes& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i)
    bytes[at + i] = static_cast<std::byte>((value >> (8 * i)) & 0xffU);
}

std::uint32_t get_u32(const StoredBytes& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i)
    value |= std::to_integer<std::uint32_t>(bytes[at + i]) << (8 * i);
  return value;
}

}  // namespace

ByteSink LimitedSink::sink() {
  return {this, [](void* context, std::span<const std::byte> more) {
            auto& self = *static_cast<LimitedSink*>(context);
            if (more.size() > self.limit - self.bytes.size()) return false;
            self.bytes.insert(self.bytes.end(), more.begin(), more.end());
            return true;
          }};
}

StoredBytes stored(const LocalMap& map, const MapIdentity& identity) {
  LimitedSink sink;
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  MapFileBuffer buffer;
  const MapFileStatus status = save(map, identity, workspace, buffer, sink.sink());
  REQUIRE(status.ok());
  REQUIRE(status.offset_bytes == sink.bytes.size());
  return sink.bytes;
}

ByteSource SpanSource::source() {
  return {this, [](void* context, std::span<std::byte> into) {
            auto& self = *static_cast<SpanSource*>(context);
            const std::size_t n = std::min(into.size(), self.bytes.size());
            std::copy_n(self.bytes.begin(), n, into.begin());
            self.bytes = self.bytes.subspan(n);
            return n;
          }};
}

LoadedMap::LoadedMap(const MapConfig& config, const ClassTable& classes)
    : memory(required_bytes(config)) {
  Arena arena = memory.arena();
  Result<LocalMap> made = LocalMap::make(arena, config, classes);
  REQUIRE(made.ok());
  map = std::move(*made);
}

MapFileStatus read_header(std::span<const std::byte> bytes, MapFileHeader& header) {
  SpanSource source{bytes};
  MapFileBuffer buffer;
  return load_header(source.source(), buffer, header);
}

MapFileStatus read_into(std::span<const std::byte> bytes, LocalMap& map) {
  SpanSource source{bytes};
  MapFileBuffer buffer;
  MapFileHeader header;
  const MapFileStatus status = load_header(source.source(), buffer, header);
  return status.ok() ? load_blocks(source.source(), header, buffer, map) : status;
}

std::unique_ptr<LoadedMap> loaded(std::span<const std::byte> bytes) {
  MapFileHeader header;
  REQUIRE(read_header(bytes, header).ok());
  auto result = std::make_unique<LoadedMap>(header.config, header.classes);
  const MapFileStatus status = read_into(bytes, result->map);
  INFO(status.what);
  REQUIRE(status.ok());
  return result;
}

std::size_t header_bytes(const StoredBytes& bytes) { return kBodyOffset + get_u32(bytes, 12) + 4; }

StoredBytes with_header(const StoredBytes& bytes, const std::function<void(StoredBytes&)>& change) {
  const auto end = bytes.begin() + static_cast<std::ptrdiff_t>(header_bytes(bytes));
  StoredBytes result(bytes.begin(), end - 4);
  change(result);
  put_u32(result, 12, static_cast<std::uint32_t>(result.size() - kBodyOffset));
  const std::uint32_t crc = crc32c(result);
  result.resize(result.size() + 4);
  put_u32(result, result.size() - 4, crc);
  result.insert(result.end(), end, bytes.end());
  return result;
}

std::uint64_t digest_of(const LocalMap& map) {
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  return digest(map, workspace);
}

}  // namespace tessera
