// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/internal/strip_writer.hpp"

#include <bit>

namespace tessera {

namespace {

/// Calls visit(points) for runs of the points of these occupied units, in order: units one after
/// the other, with none of the tile's occupied ones between, are one run.
template <class Visit>
void for_point_runs(const ScanTiles& tiles, const Tile& tile, std::uint64_t units,
                    Visit&& visit) noexcept {
  while (units != 0) {
    const std::uint64_t lowest = units & (~units + 1);
    // Up to the first occupied unit that is left out.
    const std::uint64_t left_out = tile.occupied & ~units & ~(lowest - 1);
    const std::uint64_t run = units & ((left_out & (~left_out + 1)) - 1);
    const UnitSample& first = tiles.sample(tile, std::countr_zero(run));
    const UnitSample& last = tiles.sample(tile, 63 - std::countl_zero(run));
    visit(tiles.points().subspan(first.begin, last.end - first.begin));
    units &= ~run;
  }
}

/// The next tile along x that is still to be written, or null: what is written wants no more. Tiles
/// are linked where one's points reach the other; others that touch are found by way of a
/// neighbour that they share.
const Tile* next_to_write(const ScanTiles& tiles, const Tile& tile, int step) noexcept {
  const Tile* next = tiles.stepped(&tile, 0, step);
  for (std::size_t face = 2; face < 6 && next == nullptr; ++face) {
    const Tile* const aside = tiles.beside(tile, face);
    const Tile* const beyond = tiles.stepped(aside, 0, step);
    if (beyond != nullptr) next = tiles.beside(*beyond, face ^ 1U);
  }
  return next != nullptr && next->wanted != 0 ? next : nullptr;
}

/// The memory that writing to a block reads: its pages, if any, then these octets.
void prefetch_pages(const LocalMap& map, SlabHandle handle) noexcept {
  if (handle == 0) return;
  for (const SlabHandle page : map.block_at(handle).labels) {
    if (page != 0) __builtin_prefetch(map.pool().at(page), 1);
  }
}
void prefetch_octets(const LocalMap& map, SlabHandle handle, std::uint64_t octets) noexcept {
  if (handle == 0) return;
  for (; octets != 0; octets &= octets - 1) {
    const SlabHandle tuples = map.octet_handle(map.block_at(handle), std::countr_zero(octets));
    if (tuples != 0) map.tuples().prefetch_to_add(map.pool().at(tuples));
  }
}

}  // namespace

Result<StripWriter> StripWriter::make(Arena& arena) noexcept {
  const Result<KernelStrip> strip = KernelStrip::make(arena);
  if (!strip.ok()) return strip.status();
  StripWriter writer;
  writer.strip_ = *strip;
  return writer;
}

namespace {

/// Of a block that is a tile; by row order.
void find_centroids(const ScanTiles& tiles, const Tile& tile,
                    std::array<Centroid, kBlockVoxels>& into) noexcept {
  constexpr int kUnitEdge = 2;  // a unit is an octet
  for (std::uint64_t units = tile.occupied; units != 0; units &= units - 1) {
    const int unit = std::countr_zero(units);
    const UnitSample& sample = tiles.sample(tile, unit);
    const OctetCentroids found =
        centroids_of(tiles.points().subspan(sample.begin, sample.end - sample.begin),
                     octets_of_unit(unit, kUnitEdge).place[0]);
    for (int v = 0; v < kOctetVoxels; ++v)
      into[static_cast<std::size_t>(row_order(unit, v))] = found[static_cast<std::size_t>(v)];
  }
}

}  // namespace

/// From each tile that is still to be written, all of its run along x.
void StripWriter::write_all(LocalMap& map, ScanTiles& tiles, EvidenceWork& work,
                            ScanReport& report) noexcept {
  for (const Tile& tile : tiles.tiles()) {
    if (tile.wanted == 0) continue;
    const Tile* from = &tile;
    while (const Tile* const before = next_to_write(tiles, *from, -1)) from = before;
    while (from != nullptr) {
      std::array<const Tile*, KernelStrip::kTiles> strip{};
      std::size_t count = 0;
      for (; count < strip.size() && from != nullptr; from = next_to_write(tiles, *from, 1))
        strip[count++] = from;
      write(map, tiles, std::span(strip).first(count), work, report);
      for (std::size_t i = 0; i < count; ++i) tiles.mark_written(*strip[i]);
    }
  }
}

/// Adds the points of the tile at an offset from the strip's first; tiles: of the strip.
void StripWriter::add_tile(const ScanTiles& scan_tiles, const Tile* from,
                           const std::array<int, 3>& offset, int tiles,
                           EvidenceWork& work) noexcept {
  if (from == nullptr || from->occupied == 0) return;
  const auto [dx, dy, dz] = offset;
  // Units of that tile, counted from its first, that reach the strip.
  const int reach = reach_.units;
  const std::uint64_t units =
      from->occupied &
      box_mask({-reach - 4 * dx, -reach - 4 * dy, -reach - 4 * dz},
               {4 * tiles - 1 + reach - 4 * dx, 3 + reach - 4 * dy, 3 + reach - 4 * dz});
  for_point_runs(scan_tiles, *from, units, [&](std::span<const TilePoint> points) {
    strip_.add_points(points, offset, reach_.radius_voxels, kernel_, work);
  });
}

/// Adds a row of tiles along x; row: those of them that are (dy, dz) from the strip's, null where
/// none is linked. Tiles that follow on either side are linked to these.
void StripWriter::add_row(const ScanTiles& tiles, std::span<const Tile* const> strip,
                          std::span<const Tile* const> row, int dy, int dz,
                          EvidenceWork& work) noexcept {
  const int reach_tiles = (reach_.units + 3) / 4;
  const int count = static_cast<int>(row.size());
  if (reach_tiles == 1) {
    // Bit i + 1: some tile of the strip has the one at i for a source.
    unsigned sources = 0;
    for (std::size_t i = 0; i < strip.size(); ++i)
      sources |= ((strip[i]->sources >> static_cast<unsigned>(12 + 3 * dy + 9 * dz)) & 7U) << i;
    for (; sources != 0; sources &= sources - 1) {
      const int dx = std::countr_zero(sources) - 1;
      const int nearest = dx < 0 ? 0 : (dx < count ? dx : count - 1);
      const Tile* const from =
          tiles.stepped(row[static_cast<std::size_t>(nearest)], 0, dx - nearest);
      add_tile(tiles, from, {dx, dy, dz}, count, work);
    }
    return;
  }
  int dx = 0;
  const Tile* from = row.front();
  for (; dx > -reach_tiles && tiles.stepped(from, 0, -1) != nullptr; --dx)
    from = tiles.stepped(from, 0, -1);
  for (; dx < 0; ++dx, from = tiles.stepped(from, 0, 1))
    add_tile(tiles, from, {dx, dy, dz}, count, work);
  for (const Tile* const of_strip : row) add_tile(tiles, of_strip, {dx++, dy, dz}, count, work);
  from = tiles.stepped(row.back(), 0, 1);
  for (; dx < count + reach_tiles && from != nullptr; ++dx, from = tiles.stepped(from, 0, 1))
    add_tile(tiles, from, {dx, dy, dz}, count, work);
}

/// Points reach boxes of units, so between a tile and one that its points reach there is a tile
/// wherever the way goes: where a step leads to none, no point reaches from there. In this order a
/// voxel's sum is the same whatever strip it is in.
void StripWriter::sum(const LocalMap& map, const ScanTiles& tiles,
                      std::span<const Tile* const> strip, EvidenceWork& work) noexcept {
  const int reach_tiles = (reach_.units + 3) / 4;
  strip_.begin(static_cast<int>(strip.size()));
  // Sums take longer than memory does.
  for (const Tile* const tile : strip) prefetch_pages(map, tile->blocks[0]);
  using TileRow = std::array<const Tile*, KernelStrip::kTiles>;
  const auto step = [&](std::span<const Tile* const> from, std::size_t axis, int steps,
                        TileRow& to) {
    bool any = false;
    for (std::size_t i = 0; i < from.size(); ++i) {
      to[i] = tiles.stepped(from[i], axis, steps);
      any = any || to[i] != nullptr;
    }
    return any;
  };
  TileRow on_z{};
  TileRow on_y{};
  const std::span<const Tile* const> slice = std::span(on_z).first(strip.size());
  const std::span<const Tile* const> row = std::span(on_y).first(strip.size());
  for (int dz = -reach_tiles; dz <= reach_tiles; ++dz) {
    for (const Tile* const tile : strip) {
      if (dz == 0) prefetch_octets(map, tile->blocks[0], tile->wanted);
    }
    if (!step(strip, 2, dz, on_z)) continue;
    for (int dy = -reach_tiles; dy <= reach_tiles; ++dy) {
      if (step(slice, 1, dy, on_y)) add_row(tiles, strip, row, dy, dz, work);
    }
  }
}

void StripWriter::write(LocalMap& map, const ScanTiles& tiles, std::span<const Tile* const> strip,
                        EvidenceWork& work, ScanReport& report) noexcept {
  sum(map, tiles, strip, work);
  ++report.strips;
  for (std::size_t i = 0; i < strip.size(); ++i) {
    const SlabHandle block = strip[i]->blocks[0];
    const int tile = static_cast<int>(i);
    const std::uint64_t octets = strip[i]->wanted & strip_.touched(tile);
    if (octets == 0 || block == 0) continue;
    std::array<Centroid, kBlockVoxels> centroids{};
    find_centroids(tiles, *strip[i], centroids);
    BlockEvidence sums = strip_.sums(tile);
    sums.centroids = centroids.data();
    // Room was reserved before anything was written, so this does not fail.
    const Result<int> written = map.add_labels(block, octets, sums);
    TESSERA_ASSERT(written.ok());
    if (written.ok()) {
      report.label_octets += static_cast<std::uint32_t>(*written);
    } else {
      ++report.write_faults;
    }
  }
}

}  // namespace tessera
