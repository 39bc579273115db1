// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Map files in memory: saving into bytes, loading from them, and changing a header's bytes with a
// checksum that fits.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "support/aligned_memory.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera {

using StoredBytes = std::vector<std::byte>;

/// Where the header's body starts: after magic, version and length.
inline constexpr std::size_t kBodyOffset = 16;

/// A sink that takes so many bytes, then refuses.
struct LimitedSink {
  std::size_t limit = static_cast<std::size_t>(-1);
  StoredBytes bytes{};
  ByteSink sink();
};

/// Saves; requires that it works.
StoredBytes stored(const LocalMap& map, const MapIdentity& identity = {});

/// A source that gives bytes from a place on.
struct SpanSource {
  std::span<const std::byte> bytes;
  ByteSource source();
};

/// A map in memory of its own, made for a header.
struct LoadedMap {
  explicit LoadedMap(const MapConfig& config, const ClassTable& classes);
  AlignedMemory memory;
  LocalMap map;
};

/// Only the header.
MapFileStatus read_header(std::span<const std::byte> bytes, MapFileHeader& header);

/// Header and blocks into an empty map.
MapFileStatus read_into(std::span<const std::byte> bytes, LocalMap& map);

/// A map from sound bytes, in just the storage that the header asks for.
std::unique_ptr<LoadedMap> loaded(std::span<const std::byte> bytes);

/// Bytes of the header with its checksum.
std::size_t header_bytes(const StoredBytes& bytes);

/// The file with preamble and body changed, the length and the checksum put right.
StoredBytes with_header(const StoredBytes& bytes, const std::function<void(StoredBytes&)>& change);

std::uint64_t digest_of(const LocalMap& map);

}  // namespace tessera
